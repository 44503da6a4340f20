"""From one whole-body pose to another, as a person gets there: nothing jumps, no bone stretches."""

from dataclasses import replace

import numpy as np

from lobstr_hw.floor import FootShape
from lobstr_hw.ik.vectors import rotate
from lobstr_hw.rotations import Array, slerp
from lobstr_hw.skeleton import Body, Joint, global_rotations
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.world_kinematics import positions

__all__ = ["blend", "over_floor"]

FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]


def blend(old: SkeletonPose, new: SkeletonPose, share: float, body: Body) -> SkeletonPose:
    """A pose in between, feet not under the floor; all that is no pose comes from the new one.

    Args:
        old: where it comes from.
        new: where it goes to.
        share: 0 is the old pose, 1 the new one.
        body: of both, in the user's size.
    """
    if share >= 1.0:
        return new
    p_hips = old.p_world[:, 0] + share * (new.p_world[:, 0] - old.p_world[:, 0])
    R_local = slerp(old.R_local, new.R_local, share)
    R_world = global_rotations(R_local)
    p = over_floor(positions(R_world, p_hips, body.offsets), R_world, FootShape.of(body))
    return replace(new, p_world=p, R_local=R_local)


def over_floor(p_world: Array, R_world: Array, shape: FootShape) -> Array:
    """Joint positions (n, 22, 3), the whole body lifted until no part of a foot is too low."""
    toe = p_world[:, TOES]
    heel = toe + rotate(R_world[:, FEET], shape.heel)
    tip = toe + rotate(R_world[:, TOES], shape.tip)
    lowest = np.minimum(toe[..., 1] - shape.ball_m, tip[..., 1] - shape.tip_m)
    lowest = np.minimum(lowest, heel[..., 1]).min(axis=-1)
    lift = np.maximum(-lowest, 0.0)
    return np.asarray(p_world + lift[:, None, None] * np.array([0.0, 1.0, 0.0]))
