"""The eight joints of the network: C, U, L, F of the left, then of the right.

The paper's two "hip joints" C take the reference frame into the tilted pelvis; no rig has them:

    toe_s = p_ref + R_ref C_s (o_upper_leg + U_s (o_lower_leg + L_s (o_foot + F_s o_toes)))
"""

import numpy as np

from lobstr_hw.rotations import Array, from_6d, to_6d, transpose
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

__all__ = [
    "JOINT_ORDER",
    "LEG_JOINTS",
    "POSE_SIZE",
    "leg_points_in_reference",
    "mirror_pose_6d",
    "pose_6d",
    "pose_from_6d",
    "toes_in_reference",
    "true_lower_body",
]

LEG_JOINTS = (
    (Joint.LEFT_UPPER_LEG, Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT, Joint.LEFT_TOES),
    (Joint.RIGHT_UPPER_LEG, Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT, Joint.RIGHT_TOES),
)
JOINT_ORDER = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("hip_joint", "upper_leg", "lower_leg", "foot")
)
"""Of the 48 numbers: the model card carries it, and other weights are refused."""

POSE_SIZE = 6 * len(JOINT_ORDER)


def true_lower_body(R_local: Array, R_ref: Array) -> Array:
    """The truth of the network's output (..., 2, 4, 3, 3).

    Args:
        R_local: (..., 22, 3, 3), the hips in the world.
        R_ref: (..., 3, 3).
    """
    C = transpose(R_ref) @ R_local[..., Joint.HIPS, :, :]
    sides = [
        np.stack([C, *(R_local[..., joint, :, :] for joint in leg[:3])], axis=-3)
        for leg in LEG_JOINTS
    ]
    return np.stack(sides, axis=-4)


def pose_6d(joints: Array) -> Array:
    """Joints (..., 2, 4, 3, 3) -> 48 numbers."""
    return to_6d(joints).reshape(*joints.shape[:-4], POSE_SIZE)


def pose_from_6d(pose: Array) -> Array:
    """48 numbers -> joints (..., 2, 4, 3, 3)."""
    return from_6d(pose.reshape(*pose.shape[:-1], 2, 4, 6))


def mirror_pose_6d(pose: Array) -> Array:
    """Left and right exchanged."""
    sides = pose.reshape(*pose.shape[:-1], 2, 4, 6)[..., ::-1, :, :].copy()
    sides[..., ::3] *= -1.0  # the x of the Z axis and of the Y axis
    return np.asarray(sides.reshape(pose.shape))


def leg_points_in_reference(joints: Array) -> Array:
    """Hip, knee, ankle and toe base (..., 2, 4, 3) in the reference frame, standard skeleton."""
    offsets = np.stack([STANDARD_OFFSETS[list(leg)] for leg in LEG_JOINTS])  # (2, 4, 3)
    R = joints[..., 0, :, :]
    points = [(R @ offsets[:, 0, :, None])[..., 0]]
    for i in (1, 2, 3):
        R = R @ joints[..., i, :, :]
        points.append(points[-1] + (R @ offsets[:, i, :, None])[..., 0])
    return np.stack(points, axis=-2)


def toes_in_reference(joints: Array) -> Array:
    """Toe bases (..., 2, 3) in the reference frame, on the standard skeleton."""
    offsets = np.stack([STANDARD_OFFSETS[list(leg)] for leg in LEG_JOINTS])  # (2, 4, 3)
    p = offsets[:, 3]
    for i in (3, 2, 1):  # F, L, U
        p = offsets[:, i - 1] + (joints[..., i, :, :] @ p[..., None])[..., 0]
    return np.asarray((joints[..., 0, :, :] @ p[..., None])[..., 0])
