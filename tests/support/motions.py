"""Made motions on the standard skeleton, for tests that need no data."""

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.rotations import Array, rotation_x, rotation_y, rotation_z
from lobstr_hw.skeleton import HEEL, TOE_TIP, Joint, forward_kinematics

_TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]
_FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]


def _motion(name: str, rate_hz: float, R_local: Array, p_hips: Array) -> Motion:
    """The motion, with its lowest sole on the floor at each frame."""
    p, R = forward_kinematics(R_local, p_hips)
    tips = p[:, _TOES] + R[:, _TOES] @ TOE_TIP
    heels = p[:, _FEET] + R[:, _FEET] @ HEEL
    lowest = np.concatenate([tips, heels], axis=1)[..., 1].min(axis=1)
    p_hips = p_hips - lowest[:, None] * np.array([0.0, 1.0, 0.0])
    p_toes = forward_kinematics(R_local, p_hips)[0][:, _TOES]
    return Motion(name, "made", rate_hz, p_hips, R_local, p_toes, 1.0)


def arms_down(duration_s: float = 3.0, rate_hz: float = 45.0) -> Motion:
    """Someone who stands with hanging arms."""
    n = round(duration_s * rate_hz) + 1
    R = np.broadcast_to(np.eye(3), (n, 22, 3, 3)).copy()
    R[:, Joint.LEFT_UPPER_ARM] = rotation_z(np.deg2rad(-80.0))
    R[:, Joint.RIGHT_UPPER_ARM] = rotation_z(np.deg2rad(80.0))
    return _motion("arms_down", rate_hz, R, np.tile([0.0, 1.0, 0.0], (n, 1)))


def walking(
    duration_s: float = 4.0,
    rate_hz: float = 45.0,
    speed_m_s: float = 1.0,
    turn_rad_s: float = 0.4,
    seed: int = 0,
) -> Motion:
    """A walk along a curve, arms swinging and the head looking about."""
    rng = np.random.default_rng(seed)
    n = round(duration_s * rate_hz) + 1
    t = np.arange(n) / rate_hz
    step = 2.0 * np.pi * 0.9 * t + rng.uniform(0.0, 2.0 * np.pi)
    R = np.broadcast_to(np.eye(3), (n, 22, 3, 3)).copy()
    yaw = turn_rad_s * t
    R[:, Joint.HIPS] = rotation_y(yaw + 0.08 * np.sin(step)) @ rotation_z(0.05 * np.sin(step))
    for side, upper, lower, foot in (
        (0.0, Joint.LEFT_UPPER_LEG, Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT),
        (np.pi, Joint.RIGHT_UPPER_LEG, Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT),
    ):
        swing = 0.45 * np.sin(step + side)
        bend = 0.1 + 0.5 * np.maximum(np.cos(step + side), 0.0)
        R[:, upper] = rotation_x(-swing)
        R[:, lower] = rotation_x(bend)
        R[:, foot] = rotation_x(0.4 * (swing - bend))
    for sign, side, upper, lower in (
        (1.0, np.pi, Joint.LEFT_UPPER_ARM, Joint.LEFT_LOWER_ARM),
        (-1.0, 0.0, Joint.RIGHT_UPPER_ARM, Joint.RIGHT_LOWER_ARM),
    ):
        swing = 0.4 * np.sin(step + side)
        R[:, upper] = rotation_x(-swing) @ rotation_z(-sign * np.deg2rad(75.0))
        R[:, lower] = rotation_y(-sign * (0.4 + 0.2 * np.sin(step + side)))
    R[:, Joint.HEAD] = rotation_y(0.3 * np.sin(0.7 * t)) @ rotation_x(0.1 * np.sin(1.1 * t))
    velocity = speed_m_s / rate_hz * np.stack([np.sin(yaw), 0.0 * yaw, np.cos(yaw)], axis=-1)
    return _motion("walking", rate_hz, R, np.cumsum(velocity, axis=0) + np.array([0.0, 1.0, 0.0]))
