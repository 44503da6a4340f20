"""What a tracker says: which body part it stands for, where it is, and how far to trust it."""

from dataclasses import dataclass
from enum import StrEnum

from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Joint

__all__ = ["FOUR_POINTS", "ROLE_JOINT", "TrackerRole", "TrackerSample", "TrackingState"]


class TrackerRole(StrEnum):
    """The body part that a tracker stands for."""

    HEAD = "head"
    LEFT_HAND = "left_hand"
    RIGHT_HAND = "right_hand"
    PELVIS = "pelvis"
    LEFT_FOOT = "left_foot"
    RIGHT_FOOT = "right_foot"
    LEFT_KNEE = "left_knee"
    RIGHT_KNEE = "right_knee"
    CHEST = "chest"
    LEFT_ELBOW = "left_elbow"
    RIGHT_ELBOW = "right_elbow"


FOUR_POINTS = (
    TrackerRole.HEAD,
    TrackerRole.LEFT_HAND,
    TrackerRole.RIGHT_HAND,
    TrackerRole.PELVIS,
)
"""The paper's device set: headset, two controllers, one pelvis tracker."""

ROLE_JOINT = {
    TrackerRole.HEAD: Joint.HEAD,
    TrackerRole.LEFT_HAND: Joint.LEFT_HAND,
    TrackerRole.RIGHT_HAND: Joint.RIGHT_HAND,
    TrackerRole.PELVIS: Joint.HIPS,
    TrackerRole.LEFT_FOOT: Joint.LEFT_FOOT,
    TrackerRole.RIGHT_FOOT: Joint.RIGHT_FOOT,
    TrackerRole.LEFT_KNEE: Joint.LEFT_LOWER_LEG,
    TrackerRole.RIGHT_KNEE: Joint.RIGHT_LOWER_LEG,
    TrackerRole.CHEST: Joint.UPPER_CHEST,
    TrackerRole.LEFT_ELBOW: Joint.LEFT_LOWER_ARM,
    TrackerRole.RIGHT_ELBOW: Joint.RIGHT_LOWER_ARM,
}
"""The joint whose frame a calibrated tracker of each role gives."""


class TrackingState(StrEnum):
    """How a device came by its pose, in its own words."""

    OK = "ok"
    INERTIAL = "inertial"
    OCCLUDED = "occluded"
    OUT_OF_RANGE = "out_of_range"
    CALIBRATING = "calibrating"
    ASLEEP = "asleep"
    GONE = "gone"


@dataclass(frozen=True, slots=True, eq=False)
class TrackerSample:
    """One reading of one tracker. ``tracked`` False: the device is guessing.

    Attributes:
        serial: of the device; roles are bound to serials by the profile, above the driver.
        T_world_tracker: metres, tracking space (docs/conventions.md).
        time_s: on the one host clock, when the pose was measured.
        tracked: the device sees itself.
        state: how it came by this pose.
        velocity: (3,) metres per second, where the device knows it.
        covariance: (6, 6) of position and rotation, where the device knows it.
    """

    serial: str
    T_world_tracker: PartialPose
    time_s: float
    tracked: bool
    state: TrackingState = TrackingState.OK
    velocity: Array | None = None
    covariance: Array | None = None
