"""What OpenXR says about where something is."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array, from_quat_xyzw
from lobstr_hw.trackers import TrackingState

__all__ = ["Location", "judge"]

ORIENTATION_VALID, POSITION_VALID, ORIENTATION_TRACKED, POSITION_TRACKED = 1, 2, 4, 8
VALID = ORIENTATION_VALID | POSITION_VALID
TRACKED = ORIENTATION_TRACKED | POSITION_TRACKED


@dataclass(frozen=True, slots=True, eq=False)
class Location:
    """Where a space is.

    Attributes:
        flags: valid and tracked, of orientation and position.
        p: (3,) metres, in the stage.
        quat_xyzw: (4,).
        velocity: (3,) metres per second, where the runtime knows it.
    """

    flags: int
    p: Array
    quat_xyzw: Array
    velocity: Array | None


def judge(location: Location, awake: bool) -> tuple[TrackingState, PartialPose | None]:
    """State and pose of a device; no pose: nothing is known.

    "Valid" without "tracked" is a runtime's guess from the last sighting or from inertia.

    Args:
        location: as the runtime gave it.
        awake: the session has the focus; without it a runtime tells nothing of hands and trackers.
    """
    if not location.flags & ORIENTATION_VALID:
        return (TrackingState.OCCLUDED if awake else TrackingState.ASLEEP), None
    R = from_quat_xyzw(np.asarray(location.quat_xyzw))
    if not location.flags & POSITION_VALID:
        return TrackingState.INERTIAL, PartialPose(R, None)
    tracked = location.flags & TRACKED == TRACKED
    state = TrackingState.OK if tracked else TrackingState.OUT_OF_RANGE
    return state, PartialPose(R, location.p)
