"""What the trackers did while somebody moved, on one time grid."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.track import Track, usable
from lobstr_hw.poses import frozen
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import TrackerSample

__all__ = ["Movement", "movement_from_samples"]

RATE_HZ = 45.0


@dataclass(frozen=True, slots=True, eq=False)
class Movement:
    """Four trackers in time.

    Attributes:
        times_s: (m,) even steps of 1 / RATE_HZ.
        p: (m, 4, 3) positions in the order of FOUR_POINTS, in the tracking space, metres.
        R: (m, 4, 3, 3) rotations.
        tracked: (m, 4) whether both were seen; elsewhere they are in between what was.
    """

    times_s: Array
    p: Array
    R: Array
    tracked: Bools

    def __post_init__(self) -> None:
        """Check the shapes once."""
        object.__setattr__(self, "p", frozen(self.p, (4, 3)))
        object.__setattr__(self, "R", frozen(self.R, (4, 3, 3)))
        if not len(self.times_s) == len(self.p) == len(self.R) == len(self.tracked):
            raise ValueError(f"{len(self.times_s)} times, {len(self.p)} positions")

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.times_s)

    def between(self, start_s: float, end_s: float = np.inf) -> "Movement":
        """The part between two times."""
        part = slice(*np.searchsorted(self.times_s, [start_s, end_s]))
        return Movement(self.times_s[part], self.p[part], self.R[part], self.tracked[part])


def movement_from_samples(
    samples: Iterable[TrackerSample],
    serials: Sequence[str],
    start_s: float = -np.inf,
    end_s: float = np.inf,
) -> Movement:
    """The four trackers between two times, resampled to one grid.

    Args:
        samples: of any trackers, each one's oldest first.
        serials: in the order of FOUR_POINTS.
        start_s: nothing before it counts.
        end_s: nothing after it counts.
    """
    kept: dict[str, list[TrackerSample]] = {serial: [] for serial in serials}
    for sample in samples:
        if sample.serial in kept and start_s <= sample.time_s <= end_s and usable(sample):
            kept[sample.serial].append(sample)
    if min(len(own) for own in kept.values()) < 2:
        return Movement(np.empty(0), np.empty((0, 4, 3)), np.empty((0, 4, 3, 3)), _none())
    begin = max(own[0].time_s for own in kept.values())
    end = min(own[-1].time_s for own in kept.values())
    times = np.arange(begin, max(end, begin), 1.0 / RATE_HZ)
    tracks = [Track.of(kept[serial]).at(times) for serial in serials]
    p, R, tracked = (np.stack(values, axis=1) for values in zip(*tracks, strict=True))
    return Movement(times, p, R, tracked)


def _none() -> Bools:
    return np.empty((0, 4), dtype=bool)
