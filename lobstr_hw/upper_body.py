"""The upper body of a tick: spine, neck and arms between measured hips, head and hands."""

import numpy as np

from lobstr_hw.ik.arms import solve_arms
from lobstr_hw.ik.spine import solve_spine
from lobstr_hw.ik.vectors import rotate
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Joint

__all__ = ["ARM_JOINTS", "SPINE_JOINTS", "pose_upper_body"]

SPINE_JOINTS = [Joint.SPINE, Joint.CHEST, Joint.UPPER_CHEST, Joint.NECK]
ARM_JOINTS = [
    [Joint.LEFT_SHOULDER, Joint.LEFT_UPPER_ARM, Joint.LEFT_LOWER_ARM],
    [Joint.RIGHT_SHOULDER, Joint.RIGHT_UPPER_ARM, Joint.RIGHT_LOWER_ARM],
]


def pose_upper_body(
    p_hips: Array,
    R_hips: Array,
    p_head: Array,
    R_head: Array,
    p_hand: Array,
    R_hand: Array,
    offsets: Array,
) -> tuple[Array, Array]:
    """World rotations above the hips.

    Args:
        p_hips: (n, 3) in the world.
        R_hips: (n, 3, 3).
        p_head: (n, 3).
        R_head: (n, 3, 3).
        p_hand: left and right wrist (n, 2, 3).
        R_hand: (n, 2, 3, 3).
        offsets: (n, 22, 3) of the body.

    Returns:
        The spine's (n, 4, 3, 3) and the arms' (n, 2, 3, 3, 3), ordered as :data:`SPINE_JOINTS` and
        :data:`ARM_JOINTS`.
    """
    spine = solve_spine(p_hips, R_hips, p_head, R_head, p_hand, offsets)
    chain = np.concatenate([R_hips[:, None], spine[:, :2]], axis=1)
    steps = rotate(chain, offsets[:, Joint.SPINE : Joint.UPPER_CHEST + 1])
    p_chest = p_hips + steps.sum(axis=1)
    return spine, solve_arms(p_chest, spine[:, 2], p_hand, R_hand, offsets)
