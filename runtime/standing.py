"""The body that is shown before anyone is calibrated: standing still where the head is."""

import numpy as np

from lobstr_hw.rotations import Array, rotation_z
from lobstr_hw.skeleton import Body, Joint, forward_kinematics
from lobstr_hw.skeleton_pose import RoleReport, SkeletonPose, Source
from lobstr_hw.trackers import TrackerRole

__all__ = ["standing_pose"]

ARMS_DOWN_RAD = 1.3


def _arms_down() -> Array:
    R_local = np.tile(np.eye(3), (1, 22, 1, 1))
    R_local[0, Joint.LEFT_UPPER_ARM] = rotation_z(-ARMS_DOWN_RAD)
    R_local[0, Joint.RIGHT_UPPER_ARM] = rotation_z(ARMS_DOWN_RAD)
    R_local.setflags(write=False)
    return R_local


STANDING: Array = _arms_down()
"""Local rotations (1, 22, 3, 3); every standing pose holds this very array."""


def standing_pose(
    time_s: float, p_head: Array | None, body: Body, roles: dict[TrackerRole, RoleReport]
) -> SkeletonPose:
    """A body with its arms down and both soles on the floor.

    Args:
        time_s: of the tick.
        p_head: (3,) headset in the world, metres; None stands at the origin.
        body: one person's sizes.
        roles: how the trackers fare.
    """
    x, z = (0.0, 0.0) if p_head is None else (float(p_head[0]), float(p_head[2]))
    p_hips = np.array([[x, 1.0 / body.scale[0], z]])
    p_world, _ = forward_kinematics(STANDING, p_hips, body.offsets)
    feet = np.ones((1, 2), dtype=np.bool_)
    source = np.full((1, 22), Source.HELD, dtype=np.int8)
    return SkeletonPose(time_s, p_world, STANDING, feet, ~feet, source, roles)
