"""Arm IK: clavicle, upper arm and lower arm under a measured hand.

Both arms are solved as left arms: the right one is mirrored, solved, and mirrored back.
"""

import numpy as np

from lobstr_hw.ik.two_bone import limb_rotations, solve_two_bone, stretch_towards
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

__all__ = ["solve_arms"]

SHOULDER = [Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER]
UPPER = [Joint.LEFT_UPPER_ARM, Joint.RIGHT_UPPER_ARM]
LOWER = [Joint.LEFT_LOWER_ARM, Joint.RIGHT_LOWER_ARM]
HAND = [Joint.LEFT_HAND, Joint.RIGHT_HAND]

_MIRROR_V = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]])  # left as it is, right mirrored in X
_MIRROR_R = _MIRROR_V[:, :, None] * _MIRROR_V[:, None, :]
_HINGE = np.array([0.0, -1.0, 0.0])
"""A left elbow bends the forearm forward (+Z) about -Y; with that the elbow points to -Z."""


_CLAVICLE = np.array(
    [
        [0.0, 0.045, 0.140],
        [0.0, 0.010, 0.093],
        [0.0, 0.027, 0.227],
        [0.0, -0.179, -0.128],
    ]
)
"""Turn of a left clavicle about X, Y, Z from 1 and the hand seen from the resting upper arm, in
lengths of the arm. A least-squares fit to recorded people (docs/ik.md)."""

_POLE = np.array(
    [
        [0.41, -0.40, -0.34],
        [-0.04, 0.13, -0.14],
        [0.35, -0.02, 0.30],
        [-0.08, -0.11, 0.06],
        [-0.58, -0.08, -0.16],
        [-0.07, -0.51, 0.23],
        [0.04, -0.08, -0.50],
        [-0.10, -0.08, 0.18],
        [0.18, 0.18, -0.04],
        [0.05, -0.10, 0.07],
    ]
)
"""Where a left elbow points (X, Y, Z) from 1, the hand seen from the upper arm in lengths of the
arm, and the hand's X and Y axes: down, back and out, away from where the hand points. Fitted to
recorded people with a pull towards an elbow that hangs (docs/ik.md)."""

_FOLLOW = 0.3
"""Radians per sine of the angle between the clavicle and a hand at the end of the reach."""

_STRETCH = 0.6
"""Radians that the clavicle goes at most to help a hand that would be out of reach."""

_FULL = 0.9999
"""Of the arm's length: what counts as in reach there."""

_SINK = 0.15
"""Share of that where it would lower the shoulder: hanging arms do not pull it down."""

_TWIST = 0.5
"""Share of the hand's turn about the forearm that the forearm takes, as its two bones do."""


def solve_arms(
    p_chest: Array,
    R_chest: Array,
    p_hand: Array,
    R_hand: Array,
    offsets: Array,
) -> Array:
    """World rotations of both shoulders, upper arms and lower arms.

    Args:
        p_chest: the upper chest in the world (n, 3).
        R_chest: (n, 3, 3).
        p_hand: left and right wrist in the world (n, 2, 3).
        R_hand: (n, 2, 3, 3).
        offsets: (n, 22, 3) of the body.

    Returns:
        (n, 2, 3, 3, 3): side, then shoulder, upper arm, lower arm. A wrist in reach is met
        exactly; out of reach the arm is straight and points at it.
    """
    inverse = np.swapaxes(R_chest, -1, -2)[:, None]
    hand = rotate(inverse, p_hand - p_chest[:, None]) * _MIRROR_V
    R = _left_arms(hand, (inverse @ R_hand) * _MIRROR_R, offsets)
    return np.asarray(R_chest[:, None, None] @ (R * _MIRROR_R[:, None]))


def _left_arms(hand: Array, R_hand: Array, offsets: Array) -> Array:
    """In the chest's frame, all (n, 2, ...) as left arms."""
    clavicle, upper, lower = (offsets[:, joints] * _MIRROR_V for joints in (UPPER, LOWER, HAND))
    p_shoulder = offsets[:, SHOULDER] * _MIRROR_V
    reach = length(upper) + length(lower)
    R_shoulder = _clavicle(p_shoulder, clavicle, hand, reach)
    p_arm = p_shoulder + rotate(R_shoulder, clavicle)
    pole = _pole((hand - p_arm) / reach, R_hand)
    p_elbow = solve_two_bone(p_arm, hand, length(upper)[..., 0], length(lower)[..., 0], pole)
    to_hinge = cross(pole, hand - p_arm)
    R_upper, R_lower = limb_rotations(p_arm, p_elbow, hand, (upper, lower), _HINGE, to_hinge)
    R_lower = _share_twist(R_lower, R_hand)
    return np.stack([R_shoulder, R_upper, R_lower], axis=2)


def _clavicle(p_shoulder: Array, clavicle: Array, hand: Array, reach: Array) -> Array:
    """How the clavicle stands (..., 3, 3): as people's do, and towards a hand that is far.

    The second part never takes the upper arm away from the hand, so a hand that the resting
    shoulder could reach is reached. A far hand that hangs down hardly lowers the shoulder.
    """
    h = (hand - p_shoulder - clavicle) / reach
    far = smoothstep(length(h), 0.85, 1.0)
    people = np.concatenate([np.ones_like(far), h], axis=-1) @ _CLAVICLE
    line = hand - p_shoulder
    follow = _FOLLOW * cross(unit(clavicle), unit(line))
    follow[..., 2] = np.maximum(follow[..., 2], _SINK * follow[..., 2])
    R = turn(people + far * (follow - people))
    return stretch_towards(rotate(R, clavicle), line, _FULL * reach, _STRETCH) @ R


def _pole(h: Array, R_hand: Array) -> Array:
    """Where the elbow points (..., 3), from where the hand is and how it is turned."""
    seen = [np.ones_like(h[..., :1]), h, R_hand[..., :, 0], R_hand[..., :, 1]]
    return np.asarray(np.concatenate(seen, axis=-1) @ _POLE)


def _share_twist(R_lower: Array, R_hand: Array) -> Array:
    angle = faded_angle(*twist_terms(np.swapaxes(R_lower, -1, -2) @ R_hand, axis=0))
    return np.asarray(R_lower @ turn(_TWIST * angle[..., None] * np.array([1.0, 0.0, 0.0])))
