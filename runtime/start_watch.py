"""The one-second check at every start: does a profile still fit who stands there?"""

from collections import deque
from collections.abc import Sequence

from lobstr_hw.calibration import Calibration, movement_from_samples
from lobstr_hw.calibration.start_check import check_start, needed_serials
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.trackers import TrackerSample

__all__ = ["StartWatch"]

LOOK_S = 1.0
EVERY_S = 0.5
GIVE_UP_S = 60.0
"""Who has not stood still by then is busy; the check says nothing of somebody who moves."""


class StartWatch:
    """Shown the samples of every tick until somebody has stood still for a second."""

    def __init__(self, profile: Calibration, start_s: float = 0.0) -> None:
        """Begin.

        Args:
            profile: made before this session.
            start_s: time of the first tick.
        """
        self._profile = profile
        self._serials = needed_serials(profile)
        self._samples: deque[TrackerSample] = deque()
        self._next_s = start_s + LOOK_S
        self._end_s = start_s + GIVE_UP_S
        self.done = False

    def add(self, now_s: float, samples: Sequence[TrackerSample]) -> list[Spoken]:
        """Look now and then; what to say, once."""
        self._samples.extend(samples)
        while self._samples and self._samples[0].time_s < now_s - LOOK_S:
            self._samples.popleft()
        if self.done or now_s < self._next_s:
            return []
        self._next_s = now_s + EVERY_S
        check = check_start(self._profile, movement_from_samples(self._samples, self._serials))
        self.done = check.standing or now_s >= self._end_s
        if self.done:
            self._samples.clear()
        return [
            Spoken(f"Warning: {bad.advice.replace('_', ' ')}.", Sound.TROUBLE)
            for bad in check.failed[:1]
        ]
