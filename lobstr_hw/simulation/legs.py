"""Legs of the standard skeleton that stand on given ankles."""

import numpy as np

from lobstr_hw.ik import solve_two_bone
from lobstr_hw.rotations import Array, rotation_between
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

__all__ = ["LEGS", "LEG_M", "plant", "rotations_to_ankles", "sockets"]

LEGS = np.array(
    [
        [Joint.LEFT_UPPER_LEG, Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT, Joint.LEFT_TOES],
        [Joint.RIGHT_UPPER_LEG, Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT, Joint.RIGHT_TOES],
    ]
)
"""Joints of each leg (2, 4), left first."""

_SOCKETS: Array = STANDARD_OFFSETS[LEGS[:, 0]]
_THIGH = float(-STANDARD_OFFSETS[Joint.LEFT_LOWER_LEG, 1])
_SHIN = float(-STANDARD_OFFSETS[Joint.LEFT_FOOT, 1])
LEG_M = _THIGH + _SHIN
"""Hip joint to ankle, the knee straight."""


def plant(p_hips: Array, R_hips: Array, p_ankles: Array, bend_m: Array | float = 0.0) -> Array:
    """The hips (..., 3), lowered as far as the legs must be to reach both ankles (..., 2, 3).

    A leg that has just come straight stops its knee at once. ``bend_m`` (...) rounds that off: so
    far the hips keep from the height at which a leg is straight.
    """
    arm = p_ankles - sockets(p_hips, R_hips)
    level = np.hypot(arm[..., 0], arm[..., 2])
    highest = np.sqrt(np.maximum(LEG_M**2 - level**2, 0.0))
    missing = np.max(-arm[..., 1] - highest, axis=-1) + bend_m
    drop = 0.5 * (missing + np.hypot(missing, bend_m))  # a rounded maximum of this and zero
    return np.asarray(p_hips - drop[..., None] * np.array([0.0, 1.0, 0.0]))


def rotations_to_ankles(p_hips: Array, R_hips: Array, p_ankles: Array, like: Array) -> Array:
    """World rotations (..., 2, 2, 3, 3) of upper and lower legs that bring the ankles to a place.

    Args:
        p_hips: (..., 3) metres.
        R_hips: (..., 3, 3).
        p_ankles: (..., 2, 3); one out of reach is pointed at.
        like: (..., 2, 2, 3, 3) legs that these should resemble; knees bend as theirs do.
    """
    socket = sockets(p_hips, R_hips)
    # the knee is a hinge about X: it stands off the line to the ankle at right angles to both
    pole = np.cross(p_ankles - socket, like[..., 0, :, 0])
    knee = solve_two_bone(socket, p_ankles, _THIGH, _SHIN, pole)
    up = np.stack([socket - knee, knee - p_ankles], axis=-2)
    # the smallest turn, so that a leg keeps its twist
    return np.asarray(rotation_between(like[..., :, 1], up) @ like)


def sockets(p_hips: Array, R_hips: Array) -> Array:
    """Both hip joints (..., 2, 3) in the world."""
    turned = (R_hips[..., None, :, :] @ _SOCKETS[..., None])[..., 0]
    return np.asarray(p_hips[..., None, :] + turned)
