"""The output contract: where skeletons go."""

from collections.abc import Sequence
from typing import Protocol

from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample

__all__ = ["Output"]


class Output(Protocol):
    """Takes a skeleton each tick.

    ``send`` returns at once. Sockets drop the oldest when they cannot keep up; files drop nothing.
    """

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Get ready; OutputError when that is impossible.

        Args:
            body: the sizes known before calibration (the standard body at the start).
            rate_hz: of the loop.
            take: name of this recording.
        """
        ...

    def calibrated(self, body: Body) -> None:
        """The user's sizes are known now; called once, before the first pose of that size."""
        ...

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        """One tick: the pose and the samples that arrived since the last."""
        ...

    def close(self) -> None:
        """Write what is left; twice is harmless."""
        ...
