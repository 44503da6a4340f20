"""A walk whose feet stand still and flat, and the same walk on rigs with any joint frames."""

from pathlib import Path

import numpy as np

from lobstr_hw.bvh import write_bvh
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting.legs import solve_legs
from lobstr_hw.rotations import Array, from_rotation_vector, rotation_x, rotation_y, rotation_z
from lobstr_hw.skeleton import PARENTS, STANDARD_OFFSETS, Joint, global_rotations

STEP_S = 0.55
MIXAMO = (
    *("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"),
    *("LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand"),
    *("RightShoulder", "RightArm", "RightForeArm", "RightHand"),
    *("LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase"),
    *("RightUpLeg", "RightLeg", "RightFoot", "RightToeBase"),
)


def planted_walk(duration_s: float = 8.0, rate_hz: float = 45.0, speed_m_s: float = 1.1) -> Motion:
    """Straight ahead along Z; each toe base stands still, the foot flat, while the other swings."""
    t = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    R = np.tile(np.eye(3), (len(t), 22, 1, 1))
    phase = np.pi * t / STEP_S
    R[:, Joint.HIPS] = rotation_y(0.07 * np.sin(phase)) @ rotation_z(0.03 * np.sin(phase))
    R[:, Joint.HEAD] = rotation_y(0.1 * np.sin(0.9 * t))
    for sign, upper, lower in (
        (1.0, Joint.LEFT_UPPER_ARM, Joint.LEFT_LOWER_ARM),
        (-1.0, Joint.RIGHT_UPPER_ARM, Joint.RIGHT_LOWER_ARM),
    ):
        swing = sign * 0.35 * np.sin(phase)
        R[:, upper] = rotation_x(swing) @ rotation_z(np.full(len(t), -sign * 1.35))
        R[:, lower] = rotation_y(-sign * (0.7 + swing))
    toes = np.stack([_toe(t, side, speed_m_s) for side in (0, 1)], axis=1)
    world = global_rotations(R)
    for side, foot in enumerate((Joint.LEFT_FOOT, Joint.RIGHT_FOOT)):
        # the foot is level in the world, and points down with the swing
        lift = (toes[:, side, 1] - 0.02) * 5.0
        knee = world[:, foot - 1]
        R[:, foot] = (
            np.swapaxes(knee, -1, -2) @ rotation_y(_OUT * (1 - 2 * side)) @ rotation_x(lift)
        )
    p_hips = np.stack([0.0 * t, 0.95 + 0.01 * np.cos(2.0 * phase), speed_m_s * t], axis=-1)
    R = solve_legs(R, p_hips, toes)
    return Motion("made/planted_walk", "made", rate_hz, p_hips, R, toes, 1.0)


_OUT = 0.1


def _toe(t: Array, side: int, speed_m_s: float) -> Array:
    """Two steps are a stride; a foot swings over the second half of its own."""
    stride = t / (2.0 * STEP_S) + 0.5 * side
    k, f = np.floor(stride), stride % 1.0
    s = np.clip((f - 0.5) / 0.5, 0.0, 1.0)
    way = k + s**3 * (10.0 - 15.0 * s + 6.0 * s**2)  # minimum jerk
    length = 2.0 * STEP_S * speed_m_s
    z = length * (way - 0.5 * side) + 0.25 * length + 0.06
    y = 0.02 + 0.1 * np.sin(np.pi * s) ** 2
    return np.stack([np.full(len(t), 0.09 * (1 - 2 * side)), y, z], axis=-1)


def write_rig(
    path: Path,
    motion: Motion,
    seed: int,
    names: tuple[str, ...] = MIXAMO,
    size: float = 0.9,
    rate_hz: float | None = None,
) -> None:
    """The motion on a rig whose every joint frame is turned at random, in another size."""
    rng = np.random.default_rng(seed)
    B = from_rotation_vector(rng.normal(0.0, 1.0, (22, 3)))
    R = global_rotations(motion.R_local) @ B
    parents = np.maximum(PARENTS, 0)
    offsets = (np.swapaxes(B[parents], -1, -2) @ STANDARD_OFFSETS[..., None])[..., 0] * size
    offsets[0] = 0.0
    R_local = np.array(R)
    R_local[:, 1:] = np.swapaxes(R[:, PARENTS[1:]], -1, -2) @ R[:, 1:]
    path.parent.mkdir(exist_ok=True)
    write_bvh(path, motion.p_hips * size, R_local, rate_hz or motion.rate_hz, offsets, names)
