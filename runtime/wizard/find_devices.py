"""First step: four devices in sight, and what each of them stands for."""

from collections.abc import Sequence

from lobstr_hw.calibration import TPoseDetector
from lobstr_hw.calibration.roles import missing_role
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.trackers import FOUR_POINTS, TrackerSample

__all__ = ["FindDevices"]

CONFIRM_S = 3.0
"""Time to object; a person in a headset hears the roles and need do nothing."""
CHANGED_CONFIRM_S = 10.0
"""Once somebody is at the keyboard."""
GUESS_HOLD_S = 0.5


class FindDevices(Stage):
    """Waits for the four; those that do not say what they are are told apart in a T-pose."""

    title = "Devices"
    counted = False
    repeats_s = 20.0

    def __init__(self, person: Person, confirm_s: float = CONFIRM_S) -> None:
        """Begin.

        Args:
            person: what is known so far.
            confirm_s: how long roles stand before they count as agreed.
        """
        super().__init__(person)
        self._confirm_s = confirm_s
        self._complete_s: float | None = None
        self._now_s = 0.0
        self._detector = TPoseDetector(hold_s=GUESS_HOLD_S)
        self._guessed = False
        self._wait_for_devices()

    def _wait_for_devices(self) -> None:
        self.instruction = "Switch on headset, both controllers and the pelvis tracker."
        self.spoken = "Looking for your devices."

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Done when the four are in sight and nobody objects."""
        self._now_s = now_s
        table = self.person.table
        missing = table.missing(now_s)
        self._tell_apart(samples, len(missing), table.nameless(now_s))
        if table.missing(now_s):
            self._complete_s = None
            return False
        if self._complete_s is None:
            self._complete_s = now_s
            how = "Told apart by where they are" if self._guessed else "All four are in sight"
            self.instruction = f"{how}. Wrong? Press a number to change what it is."
            self.spoken = "All four found."
        return pressed is not None or now_s - self._complete_s >= self._confirm_s

    def _tell_apart(self, samples: Sequence[TrackerSample], missing: int, nameless: int) -> None:
        """Guess roles when enough devices are in sight but some do not say what they are."""
        self._detector.hints = dict(self.person.table.roles)
        pose = self._detector.add(samples)
        if not missing:
            return
        if nameless < missing:
            self._wait_for_devices()
            return
        self.instruction = (
            "Stretch both arms out to the sides and look ahead: so your trackers are told apart."
        )
        self.spoken = "Stretch out both arms, so that I can tell your trackers apart."
        if pose is not None:
            self._guessed = True
            self.person.table.guess(pose.serials)

    def press(self, number: int) -> Spoken | None:
        """The keyboard names a device; it gets the next role."""
        words = self.person.table.change(number)
        if not words:
            return Spoken(f"There is no number {number}.", Sound.TROUBLE)
        self._confirm_s = max(self._confirm_s, CHANGED_CONFIRM_S)
        self._complete_s = None
        return Spoken(words.capitalize() + ".")

    def advice(self) -> str:
        """Which of the four is not in sight."""
        missing = self.person.table.missing(self._now_s)
        if not missing or self.person.table.nameless(self._now_s) >= len(missing):
            return ""
        names = " and ".join(role.replace("_", " ") for role in missing)
        return f"no tracker in sight for {names}"

    def progress(self) -> float | None:
        """Of the time to object."""
        if self._complete_s is None:
            return None
        return min(1.0, (self._now_s - self._complete_s) / max(self._confirm_s, 1e-9))

    def done_words(self) -> Spoken | None:
        """The roles are agreed."""
        return None

    def failure(self) -> CalibrationError:
        """What was seen, and what is missing."""
        roles = {row.serial: row.role for row in self.person.table.rows(self._now_s)}
        unseen = self.person.table.missing(self._now_s)
        if all(role in roles.values() for role in FOUR_POINTS) and unseen:
            names = " and ".join(role.replace("_", " ") for role in unseen)
            return CalibrationError(
                f"{names}: there, but not tracked. See that no body or furniture hides it, and "
                "calibrate again."
            )
        return missing_role(roles)

    def shows_devices(self) -> bool:
        """They are what this step is about."""
        return True
