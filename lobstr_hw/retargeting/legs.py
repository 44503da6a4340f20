"""Legs solved anew: a rig's toe base is met although the standard foot and thigh are others."""

import numpy as np

from lobstr_hw.retargeting.source import LEGS
from lobstr_hw.rotations import Array, angle_between, normalize, rotation_between
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint, forward_kinematics, local_rotations

__all__ = ["solve_legs"]

_THIGH = -float(STANDARD_OFFSETS[Joint.LEFT_LOWER_LEG, 1])
_SHIN = -float(STANDARD_OFFSETS[Joint.LEFT_FOOT, 1])
_STRAIGHT, _BENT = np.radians([10.0, 35.0])
_REACH = 0.9995
"""Of thigh and shin: at the full length the knee's place would have an infinite slope."""


def solve_legs(R_local: Array, p_hips: Array, p_toes: Array) -> Array:
    """Turn thighs and shins so that the toe bases are met; feet keep their world rotation.

    The knee stays in its plane and becomes a pure hinge: some rigs twist the shin by up to 15
    degrees while they bend it, which no tracker could tell and no toe shows. Where the toe base is
    out of reach the leg is straight towards it.

    Args:
        R_local: (F, 22, 3, 3) of the standard skeleton.
        p_hips: (F, 3) metres.
        p_toes: (F, 2, 3) toe bases to meet.

    Returns:
        R_local (F, 22, 3, 3).
    """
    p, R = forward_kinematics(R_local, p_hips)
    for side, (upper, lower, foot, toes) in enumerate(LEGS):
        p_ankle = p_toes[:, side] - R[:, foot] @ STANDARD_OFFSETS[toes]
        to_ankle = p_ankle - p[:, upper]
        d = np.linalg.norm(to_ankle, axis=-1)
        d = np.clip(d, abs(_THIGH - _SHIN) + 1e-4, _REACH * (_THIGH + _SHIN))
        ahead = normalize(to_ankle)
        x = _hinge(p, R, side)
        x = normalize(x - np.sum(x * ahead, axis=-1, keepdims=True) * ahead)
        front = np.cross(ahead, x)
        along = (_THIGH**2 - _SHIN**2 + d**2) / (2.0 * d)
        aside = np.sqrt(np.maximum(_THIGH**2 - along**2, 0.0))
        p_knee = p[:, upper] + along[:, None] * ahead + aside[:, None] * front
        p_end = p[:, upper] + d[:, None] * ahead
        R[:, upper] = _bone(p[:, upper] - p_knee, x)
        R[:, lower] = _bone(p_knee - p_end, x)
    return local_rotations(R)


def _hinge(p: Array, R: Array, side: int) -> Array:
    """The knee's axis: normal to thigh and shin where it is bent, near their frames' X before.

    Some clips twist a whole thigh or shin by half a turn (the foot turned back again), so a frame's
    X counts only as far as the pelvis, carried along by the thigh's swing, agrees with it.
    """
    upper, lower, foot, _ = LEGS[side]
    thigh, shin = p[:, lower] - p[:, upper], p[:, foot] - p[:, lower]
    normal = np.cross(thigh, shin)
    bend = angle_between(thigh, shin)[:, None]
    hips = R[:, Joint.HIPS]
    # swung by R from straight down, the pelvis' X is R X; a leg turns out by up to 90 degrees
    swung = (rotation_between(-hips[:, :, 1], thigh) @ hips)[:, :, 0]
    frames = 0.2 * swung
    for joint in (upper, lower):
        x = R[:, joint, :, 0]
        trust = np.clip(0.5 + 2.0 * np.sum(x * swung, axis=-1, keepdims=True), 0.0, 1.0)
        frames = frames + trust * x
    frames = normalize(frames)
    # a knee that bends backward is an overstretched one: only there the frames know the front
    back = (np.sum(normal * frames, axis=-1, keepdims=True) < 0.0) & (bend < _BENT)
    normal = np.where(back, -normal, normal)
    # a normal is a good axis from 35 degrees on and noise under 10
    w = np.clip((bend - _STRAIGHT) / (_BENT - _STRAIGHT), 0.0, 1.0)
    return normalize((1.0 - w) * frames + w * normalize(normal))


def _bone(y: Array, x: Array) -> Array:
    """The frame whose Y is along the bone and whose X is nearest to ``x``."""
    y = normalize(y)
    x = normalize(x - np.sum(x * y, axis=-1, keepdims=True) * y)
    return np.stack([x, y, np.cross(x, y)], axis=-1)
