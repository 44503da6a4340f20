"""One tracker in time, and where it was in between."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, slerp
from lobstr_hw.trackers import TrackerSample

__all__ = ["LONGEST_GAP_S", "Track", "usable"]

LONGEST_GAP_S = 0.1
"""Where nothing was seen for longer, nothing is known of what was in between."""

FARTHEST_M = 1000.0
"""From the origin; a device that says more is broken, and its squares overflow."""


def usable(sample: TrackerSample) -> bool:
    """Whether the device saw itself, its numbers are finite, and it is in anybody's room."""
    pose = sample.T_world_tracker
    return bool(
        sample.tracked
        and pose.p is not None
        and (np.abs(pose.p) < FARTHEST_M).all()  # false for what is no number, too
        and np.isfinite(pose.R).all()
    )


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What one tracker said, as far as it can be used.

    Attributes:
        times_s: (m,) ascending.
        p: (m, 3) metres, in its tracking space.
        R: (m, 3, 3).
    """

    times_s: Array
    p: Array
    R: Array

    @staticmethod
    def of(samples: Iterable[TrackerSample]) -> "Track":
        """From one tracker's samples, oldest first."""
        kept = [sample for sample in samples if usable(sample)]
        return Track(
            np.array([sample.time_s for sample in kept]),
            np.array([sample.T_world_tracker.p for sample in kept]).reshape(-1, 3),
            np.array([sample.T_world_tracker.R for sample in kept]).reshape(-1, 3, 3),
        )

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.times_s)

    def at(self, times_s: Array) -> tuple[Array, Array, Bools]:
        """Where it was at times (m,) between its first sample and its last; it takes two samples.

        Returns:
            p (m, 3), R (m, 3, 3), and whether it was seen (m).
        """
        own = self.times_s
        j = np.clip(np.searchsorted(own, times_s, side="right"), 1, len(own) - 1)
        gap = own[j] - own[j - 1]
        f = np.clip((times_s - own[j - 1]) / np.maximum(gap, 1e-9), 0.0, 1.0)
        p = self.p[j - 1] + f[:, None] * (self.p[j] - self.p[j - 1])
        inside = (times_s >= own[0]) & (times_s <= own[-1])
        return p, slerp(self.R[j - 1], self.R[j], f), inside & (gap <= LONGEST_GAP_S)
