"""The T-pose itself, with its quality shown live."""

from collections import deque
from collections.abc import Sequence

from lobstr_hw.calibration import TPose, TPoseDetector, TPoseQuality, calibrate_t_pose
from lobstr_hw.calibration.self_check import AFTER_S
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.wizard.bars import quality_bars, worst_advice
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.runtime.wizard.view import Bar
from lobstr_hw.trackers import TrackerSample

__all__ = ["TakeTPose"]

HOLD_S = 1.5
SETTLE_S = 0.4
"""The first window that is good enough has the last centimetres of raising the arms in it; for so
long a stiller one is looked for."""
KEPT_S = 6.0
ARRIVED_S = 0.2
"""The first window may have so much of raising the arms in it, which the self-check would take for
trackers that slip."""
GLANCE_S = 0.4
"""The bars look at so little time, to follow a movement at once."""


class TakeTPose(Stage):
    """Done when a T-pose was held; a trigger press begins the holding anew."""

    title = "T-pose"
    instruction = "Stretch both arms out to the sides, hands as high as your shoulders. Hold still."
    spoken = "Now a T pose. Arms straight out to the sides, and hold."
    repeats_s = 12.0

    def __init__(self, person: Person) -> None:
        """Begin with nothing seen."""
        super().__init__(person)
        self._begin()

    def _begin(self) -> None:
        hints, floor_m = self.person.table.roles, self.person.floor_m
        self._held = TPoseDetector(hints, hold_s=HOLD_S, floor_m=floor_m)
        self._glance = TPoseDetector(hints, hold_s=GLANCE_S, floor_m=floor_m)
        self._kept: deque[TrackerSample] = deque()
        self._best: TPose | None = None
        self._best_since_s = 0.0
        self._good_s: float | None = None
        self._now_s = 0.0

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Look for a held T-pose, and calibrate from it."""
        if pressed is not None:
            self._begin()
        self._now_s = now_s
        for detector in (self._held, self._glance):
            detector.hints.update(self.person.table.roles)
        self._kept.extend(samples)
        while self._kept and self._kept[0].time_s < now_s - KEPT_S:
            self._kept.popleft()
        for sample in samples:
            self._glance.add((sample,))
            if self._best is None or sample.time_s - self._best_since_s < SETTLE_S:
                self._choose(self._held.add((sample,)))
            elif sample.time_s >= self._best.end_s + AFTER_S:
                self._calibrate(self._best)
                return True
        if self._quality is None or not self._quality.ok:
            self._good_s = None
        elif self._good_s is None:
            self._good_s = now_s - GLANCE_S
        return False

    def end(self) -> bool:
        """A log that ends in a T-pose has one all the same."""
        if self._best is not None:
            self._calibrate(self._best)
        return self._best is not None

    def _choose(self, pose: TPose | None) -> None:
        if pose is None:
            return
        if self._best is None:
            self._best_since_s = pose.end_s
        if self._best is None or pose.spread_m < self._best.spread_m:
            self._best = pose

    def _calibrate(self, pose: TPose) -> None:
        person = self.person
        person.t_pose = pose
        held_s = self._best_since_s - HOLD_S + ARRIVED_S
        person.movement = [sample for sample in self._kept if sample.time_s >= held_s]
        person.calibration = calibrate_t_pose(
            pose, stature_m=person.stature_m, floor_m=person.floor_m, created=person.created
        )

    @property
    def _quality(self) -> TPoseQuality | None:
        return self._glance.latest

    def bars(self) -> tuple[Bar, ...]:
        """Stillness, arms, level, heading, uprightness."""
        return quality_bars(self._quality)

    def advice(self) -> str:
        """What to do about the worst check."""
        return worst_advice(self._quality)

    def progress(self) -> float | None:
        """Of the holding."""
        if self._good_s is None:
            return 0.0
        return min(1.0, (self._now_s - self._good_s) / (HOLD_S + SETTLE_S + AFTER_S))

    def done_words(self) -> Spoken | None:
        """The pose is taken."""
        return Spoken("Got it.", Sound.DONE)

    def failure(self) -> CalibrationError:
        """What was missing, as the detector has it."""
        return self._held.failure()
