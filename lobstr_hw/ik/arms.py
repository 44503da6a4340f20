"""Arm IK: clavicle, upper arm and lower arm under a measured hand.

Both arms are solved as left arms: the right one is mirrored, solved, and mirrored back.
"""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.ik.two_bone import limb_rotations, solve_two_bone
from lobstr_hw.ik.vectors import (
    cross,
    faded_angle,
    length,
    rotate,
    smoothstep,
    turn,
    twist_terms,
    unit,
)
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Joint

__all__ = ["ArmSettings", "solve_arms"]

SHOULDER = [Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER]
UPPER = [Joint.LEFT_UPPER_ARM, Joint.RIGHT_UPPER_ARM]
LOWER = [Joint.LEFT_LOWER_ARM, Joint.RIGHT_LOWER_ARM]
HAND = [Joint.LEFT_HAND, Joint.RIGHT_HAND]

_MIRROR_V = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]])  # left as it is, right mirrored in X
_MIRROR_R = _MIRROR_V[:, :, None] * _MIRROR_V[:, None, :]
_HINGE = np.array([0.0, -1.0, 0.0])
"""A left elbow bends the forearm forward (+Z) about -Y; with that the elbow points to -Z."""


@dataclass(frozen=True, slots=True)
class ArmSettings:
    """How the arm follows the hand.

    Attributes:
        clavicle: radians per sine of the angle between clavicle and hand, for a far hand.
        twist: share of the hand's turn about the forearm that the forearm takes.
    """

    clavicle: float = 0.3
    twist: float = 0.5


def solve_arms(
    p_chest: Array,
    R_chest: Array,
    p_hand: Array,
    R_hand: Array,
    offsets: Array,
    settings: ArmSettings | None = None,
) -> Array:
    """World rotations of both shoulders, upper arms and lower arms.

    Args:
        p_chest: the upper chest in the world (n, 3).
        R_chest: (n, 3, 3).
        p_hand: left and right wrist in the world (n, 2, 3).
        R_hand: (n, 2, 3, 3).
        offsets: (n, 22, 3) of the body.
        settings: shares; the defaults if None.

    Returns:
        (n, 2, 3, 3, 3): side, then shoulder, upper arm, lower arm. A wrist in reach is met
        exactly; out of reach the arm is straight and points at it.
    """
    settings = settings or ArmSettings()
    inverse = np.swapaxes(R_chest, -1, -2)[:, None]
    hand = rotate(inverse, p_hand - p_chest[:, None]) * _MIRROR_V
    R = _left_arms(hand, (inverse @ R_hand) * _MIRROR_R, offsets, settings)
    return np.asarray(R_chest[:, None, None] @ (R * _MIRROR_R[:, None]))


def _left_arms(hand: Array, R_hand: Array, offsets: Array, settings: ArmSettings) -> Array:
    """In the chest's frame, all (n, 2, ...) as left arms."""
    clavicle, upper, lower = (offsets[:, joints] * _MIRROR_V for joints in (UPPER, LOWER, HAND))
    p_shoulder = offsets[:, SHOULDER] * _MIRROR_V
    reach = length(upper) + length(lower)
    R_shoulder = _clavicle(p_shoulder, clavicle, hand, reach, settings)
    p_arm = p_shoulder + rotate(R_shoulder, clavicle)
    pole = _pole(hand - p_arm, reach, R_hand)
    p_elbow = solve_two_bone(p_arm, hand, length(upper)[..., 0], length(lower)[..., 0], pole)
    to_hinge = cross(pole, hand - p_arm)
    R_upper, R_lower = limb_rotations(p_arm, p_elbow, hand, (upper, lower), _HINGE, to_hinge)
    R_lower = _share_twist(R_lower, R_hand, settings)
    return np.stack([R_shoulder, R_upper, R_lower], axis=2)


def _clavicle(
    p_shoulder: Array, clavicle: Array, hand: Array, reach: Array, settings: ArmSettings
) -> Array:
    """It follows a little towards a hand that is far, not at all to one that is near."""
    far = smoothstep(length(hand - p_shoulder - clavicle) / reach, 0.6, 1.1)
    axis = cross(unit(clavicle), unit(hand - p_shoulder))
    return turn(settings.clavicle * far * axis)


def _pole(hand: Array, reach: Array, R_hand: Array) -> Array:
    """Where the elbow points (..., 3), from where the hand is and how it is turned."""
    h = hand / reach
    behind_hand = -R_hand[..., :, 0]
    base = np.array([0.35, -1.0, -0.6])
    return np.asarray(base + 0.4 * behind_hand + h[..., 1:2] * np.array([0.6, 0.0, 0.0]))


def _share_twist(R_lower: Array, R_hand: Array, settings: ArmSettings) -> Array:
    angle = faded_angle(*twist_terms(np.swapaxes(R_lower, -1, -2) @ R_hand, axis=0))
    return np.asarray(R_lower @ turn(settings.twist * angle[..., None] * np.array([1.0, 0.0, 0.0])))
