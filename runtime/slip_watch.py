"""Has a tracker slipped in the session? Looked at when somebody stands upright and still."""

from collections import Counter, deque
from collections.abc import Sequence

from lobstr_hw.calibration import Calibration, Check, movement_from_samples
from lobstr_hw.calibration.start_check import StartCheck, check_start, needed_serials
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.trackers import TrackerSample

__all__ = ["SlipWatch"]

LOOK_S = 1.0
EVERY_S = 2.0
UPRIGHT = ("height", "head tilt")
"""Who bows or crouches is out of these too, and looks like somebody whose tracker slipped."""
LOOKS = {"hips height": 4, "trunk": 4, "pelvis tilt": 4, "facing": 10}
"""So many times in a row it must be wrong; people stand turned for a while, too. Reaching is not
looked at: who leans out of the shoulder reaches farther than the arm is long."""


class SlipWatch:
    """Shown the samples of every tick; says each thing to do once per calibration."""

    def __init__(self) -> None:
        """Nothing is wrong."""
        self._samples: deque[TrackerSample] = deque()
        self._next_s = 0.0
        self._wrong: Counter[str] = Counter()
        self._told: set[str] = set()
        self._aim: Calibration | None = None

    def add(
        self, now_s: float, samples: Sequence[TrackerSample], calibration: Calibration
    ) -> list[Spoken]:
        """Look now and then.

        Args:
            now_s: the time of this tick.
            samples: new ones, oldest first.
            calibration: in use; with another one all begins anew.
        """
        if calibration is not self._aim:
            self._aim = calibration
            self._samples.clear()
            self._wrong.clear()
            self._told.clear()
        if now_s < self._next_s - LOOK_S:
            return []
        self._samples.extend(samples)
        while self._samples and self._samples[0].time_s < now_s - LOOK_S:
            self._samples.popleft()
        if now_s < self._next_s:
            return []
        self._next_s = now_s + EVERY_S
        second = movement_from_samples(self._samples, needed_serials(calibration))
        self._samples.clear()
        return self._judge(check_start(calibration, second))

    def _judge(self, check: StartCheck) -> list[Spoken]:
        if not check.standing or any(not c.ok for c in check.checks if c.name in UPRIGHT):
            return []
        said = []
        for one in check.checks:
            needed = LOOKS.get(one.name)
            if needed is None:
                continue
            self._wrong[one.name] = 0 if one.ok else self._wrong[one.name] + 1
            if self._wrong[one.name] >= needed and one.advice not in self._told:
                self._told.add(one.advice)
                said.append(_warning(one))
        return said


def _warning(check: Check) -> Spoken:
    return Spoken(f"Warning: {check.advice.replace('_', ' ')}.", Sound.TROUBLE)
