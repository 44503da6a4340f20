"""Frames of made-up people: a walk with swinging hands, and random poses of the four points."""

import numpy as np

from lobstr_hw.predictors.predictor import Frame
from lobstr_hw.rotations import Array, from_rotation_vector, rotation_y
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint, forward_kinematics
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT, TrackerRole

UPPER_JOINTS = list(range(1, 14))


def random_bodies(rng: np.random.Generator, n: int, size: float = 0.25) -> tuple[Array, Array]:
    """World joints of n people in random poses of the standard skeleton: p, R (n, 22, ...)."""
    R_local = from_rotation_vector(rng.normal(scale=size, size=(n, 22, 3)))
    p_hips = np.array([0.0, 0.97, 0.0]) + rng.normal(scale=0.05, size=(n, 3))
    return forward_kinematics(R_local, p_hips)


def frame_of(
    p_world: Array,
    R_world: Array,
    time_s: float,
    roles: tuple[TrackerRole, ...] = FOUR_POINTS,
) -> Frame:
    """What ideal trackers on these joints (n, 22, ...) would say."""
    joints = [ROLE_JOINT[role] for role in roles]
    valid = np.ones((len(p_world), len(roles)), dtype=bool)
    return Frame(time_s, roles, p_world[:, joints], R_world[:, joints], valid, valid)


def walk(
    time_s: float, n: int = 1, speed: float = 1.1, yaw: float = 0.3, hips_m: float = 0.95
) -> tuple[Array, Array]:
    """World joints (n, 22, ...) of walkers with straight legs: only the upper body means anything.

    They start one after the other, so that no two are alike.
    """
    t = time_s + 0.37 * np.arange(n)
    phase = 2.0 * np.pi * speed * t / 1.2
    w = np.zeros((n, 22, 3))
    w[:, Joint.HIPS, 0], w[:, Joint.HIPS, 1] = 0.05, 0.1 * np.sin(phase)
    w[:, Joint.CHEST, 1] = -0.15 * np.sin(phase)
    w[:, Joint.NECK, 0] = 0.1
    for side, joints in ((1.0, (7, 8)), (-1.0, (11, 12))):
        w[:, joints[0], 2] = -1.2 * side
        w[:, joints[1], 1] = -side * (0.4 + 0.2 * np.sin(phase))
    R_local = from_rotation_vector(w)
    R_local[:, 0] = rotation_y(np.full(n, yaw)) @ R_local[:, 0]
    way = speed * t[:, None] * np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    p_hips = way + np.array([0.0, hips_m, 0.0])
    p_hips[:, 1] += 0.02 * np.cos(2.0 * phase)
    return forward_kinematics(R_local, p_hips, STANDARD_OFFSETS)
