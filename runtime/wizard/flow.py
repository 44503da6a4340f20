"""The wizard as a machine: time, samples and events go in, words and a view come out.

No terminal, no sound and no clock inside, so that it can be tested, replayed and driven from
anywhere.
"""

from collections.abc import Callable, Sequence

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.wizard.countdown import Countdown
from lobstr_hw.runtime.wizard.find_devices import FindDevices
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.runtime.wizard.take_t_pose import TakeTPose
from lobstr_hw.runtime.wizard.view import View
from lobstr_hw.trackers import TrackerSample

__all__ = ["Wizard"]

PATIENCE_S = 2.5
"""Advice that has stood on the screen for so long is also spoken..."""
AGAIN_S = 7.0
"""...but not more often than this."""
DIGITS = tuple("123456789")
KEYS = "enter: go on   q: stop"
DEVICE_KEYS = "enter: go on   1-9: change what a device is   q: stop"

MOST_TRIES = 3

MakeStage = Callable[[Person], Stage]


class Wizard:
    """Goes through its stages.

    Attributes:
        person: what is known so far.
        done: all stages are through; ``person`` has the calibration.
        refusals: why tries were wrong, so far.
        refused: every try was wrong; ``failure`` says why.
        stopped: somebody asked for the end.
    """

    def __init__(
        self, person: Person, stages: Sequence[MakeStage], *, countdown_s: float = 0.0
    ) -> None:
        """Plan the stages.

        Args:
            person: is filled by them.
            stages: each makes its stage when its turn comes.
            countdown_s: before every stage that measures.
        """
        self.person = person
        self.done = False
        self.refused = False
        self.stopped = False
        self._plan = list(stages)
        self.refusals: list[str] = []
        self._restart_at = 0
        self._length_s = countdown_s
        self._now_s = 0.0
        self._begin(0)

    def _begin(self, index: int) -> None:
        self._index = index
        self.stage = self._plan[index](self.person)
        if self.stage.restarts:
            self._restart_at = index
        self._said = ""
        self._said_s = -float("inf")
        self._advice, self._advice_s, self._advised_s = "", 0.0, -float("inf")
        self._countdown = Countdown(self._length_s if self.stage.counted else 0.0, self._now_s)

    def add(
        self,
        now_s: float,
        samples: Sequence[TrackerSample],
        events: Sequence[DeviceEvent] = (),
        devices: Sequence[DeviceInfo] = (),
    ) -> list[Spoken]:
        """One turn.

        Args:
            now_s: its time.
            samples: new ones, oldest first.
            events: new ones.
            devices: as the driver lists them now.

        Returns:
            What to say.
        """
        self._now_s = now_s
        self.person.table.update(devices)
        self.person.table.see(samples)
        return self._turn(samples, self._pressed(events))

    def press(self, key: str) -> list[Spoken]:
        """A key: a digit names a device, Enter or space goes on, q stops."""
        if key in ("q", "Q", "\x03", "\x1b"):
            self.stopped = True
        elif key in DIGITS and isinstance(self.stage, FindDevices):
            spoken = self.stage.press(int(key))
            return [] if spoken is None else [spoken]
        elif key in ("\r", "\n", " "):
            return self._turn((), "")
        return []

    def _pressed(self, events: Sequence[DeviceEvent]) -> str | None:
        for event in events:
            if event.kind is EventKind.BUTTON_DOWN and event.name == "trigger":
                return event.serial
            if event.kind is EventKind.COMMAND and event.name == "calibrate":
                return ""
            # "get ready" leads up to the T-pose and does not touch one that is being taken
            ready = event.kind is EventKind.COMMAND and event.name == "calibrate_ready"
            if ready and not isinstance(self.stage, TakeTPose):
                return ""
        return None

    def _turn(self, samples: Sequence[TrackerSample], pressed: str | None) -> list[Spoken]:
        if self.done or self.refused:
            return []
        said = self._prompt()
        if self._counts(pressed):
            return said + self._countdown.words(self._now_s)
        if not self.stage.add(self._now_s, samples, pressed):
            return said + self._prompt() + self._advise()
        words = self.stage.done_words()
        said += [] if words is None else [words]
        return said + self._next()

    def _next(self) -> list[Spoken]:
        """The stage after this one; or once more from where it restarts."""
        said = []
        check = self.person.check
        if check is not None and not check.ok:
            self.refusals.append(check.reason)
            if len(self.refusals) == MOST_TRIES:
                self.refused = True
                return []
            advice = check.failed[0].advice.replace("_", " ")
            said = [Spoken(f"That was not right: {advice}. Once more.", Sound.TROUBLE)]
            self.person.once_more()
            self._begin(self._restart_at)
        elif self._index + 1 == len(self._plan):
            self.done = True
            return []
        else:
            self._begin(self._index + 1)
        return said + self._prompt()

    def _prompt(self) -> list[Spoken]:
        """The stage's words, when they are new or nothing has happened for long."""
        new = self.stage.spoken != self._said
        if not new and self._now_s - self._said_s < self.stage.repeats_s:
            return []
        self._said, self._said_s = self.stage.spoken, self._now_s
        return [Spoken(self.stage.spoken)] if self.stage.spoken else []

    def _counts(self, pressed: str | None) -> bool:
        """Whether a countdown is running; a press ends it."""
        if self._countdown.left_s(self._now_s) is None:
            return False
        if pressed is not None:
            self._countdown.skip()
        return True

    def _advise(self) -> list[Spoken]:
        advice = self.stage.advice()
        if advice != self._advice:
            self._advice, self._advice_s = advice, self._now_s
        if not advice or self._now_s - self._advice_s < PATIENCE_S:
            return []
        if self._now_s - max(self._advised_s, self._said_s) < AGAIN_S:
            return []
        self._advised_s = self._now_s
        return [Spoken(advice.capitalize() + ".", Sound.TROUBLE)]

    def view(self) -> View:
        """What there is to see now."""
        if self.done:
            return View("Done", (len(self._plan), len(self._plan)), "Done.")
        stage = self.stage
        return View(
            title=stage.title,
            position=(self._index + 1, len(self._plan)),
            instruction=stage.instruction,
            advice=stage.advice(),
            bars=stage.bars(),
            devices=self.person.table.rows(self._now_s) if stage.shows_devices() else (),
            progress=stage.progress(),
            countdown_s=self._countdown.left_s(self._now_s),
            keys=DEVICE_KEYS if stage.shows_devices() else KEYS,
        )

    def failure(self) -> CalibrationError:
        """Why it is not done, when nothing more comes."""
        if self.refusals:
            return CalibrationError(
                f"the calibration is refused: {self.refusals[-1]}. Nothing was saved."
            )
        return self.stage.failure()

    def end(self) -> None:
        """Nothing more comes: finish a stage that can do with what it has."""
        while not (self.done or self.refused) and self.stage.end():
            self._next()
