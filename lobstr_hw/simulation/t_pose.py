"""A person who stands in a T-pose, as well as people do."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.rotations import Array, from_rotation_vector
from lobstr_hw.simulation.legs import LEGS, plant, rotations_to_ankles
from lobstr_hw.simulation.noise import rotation_vectors, smooth_noise
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint, forward_kinematics, local_rotations

__all__ = ["PoseDeviation", "Sway", "t_pose_motion"]

_TRUNK = [Joint.SPINE, Joint.CHEST, Joint.UPPER_CHEST, Joint.NECK]
_SHOULDERS = [Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER]
_ARMS = [
    [Joint.LEFT_UPPER_ARM, Joint.LEFT_LOWER_ARM],
    [Joint.RIGHT_UPPER_ARM, Joint.RIGHT_LOWER_ARM],
]
_HANDS = [Joint.LEFT_HAND, Joint.RIGHT_HAND]


@dataclass(frozen=True, slots=True, eq=False)
class PoseDeviation:
    """How the segments of one person stand off the ideal T-pose, as turns in the world.

    Attributes:
        head, pelvis: (3,) rotation vectors.
        hands: (2, 3) of the hands, left first.
        arms: (2, 3) of the arms that carry them.
        trunk: (3,) of the back.
    """

    head: Array
    pelvis: Array
    hands: Array
    arms: Array
    trunk: Array

    @staticmethod
    def none() -> "PoseDeviation":
        """The ideal T-pose."""
        return PoseDeviation(*(np.zeros(s) for s in ((3,), (3,), (2, 3), (2, 3), (3,))))

    @staticmethod
    def drawn(rng: np.random.Generator, largest_rad: float) -> "PoseDeviation":
        """Every tracked segment and both arms off by up to this angle, the back by a third of it.

        Wrists turn apart from the arms, so the direction of an arm does not give the hand away.
        """
        head, pelvis, *rest = rotation_vectors(rng, 6, largest_rad)
        trunk = rotation_vectors(rng, 1, largest_rad / 3.0)[0]
        return PoseDeviation(head, pelvis, np.stack(rest[:2]), np.stack(rest[2:]), trunk)


@dataclass(frozen=True, slots=True)
class Sway:
    """Standard deviations of what a standing person cannot keep still (quiet stance: 4-6 mm)."""

    hips_m: float = 0.004
    trunk_rad: float = np.deg2rad(0.4)
    arms_rad: float = np.deg2rad(0.8)
    ends_rad: float = np.deg2rad(0.5)

    @staticmethod
    def none() -> "Sway":
        """A statue."""
        return Sway(0.0, 0.0, 0.0, 0.0)


def t_pose_motion(
    duration_s: float,
    rate_hz: float,
    deviation: PoseDeviation,
    sway: Sway,
    rng: np.random.Generator,
) -> Motion:
    """A T-pose on the standard skeleton at the origin, facing +Z, both feet planted."""
    times = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    n = len(times)

    def turned(vectors: Array, moving_rad: float) -> Array:
        """Rotation vectors (k, 3), each swaying on its own -> (n, k, 3, 3)."""
        moving = smooth_noise(rng, times, vectors.size, moving_rad).reshape(n, *vectors.shape)
        return from_rotation_vector(moving) @ from_rotation_vector(vectors)

    R = np.broadcast_to(np.eye(3), (n, 22, 3, 3)).copy()
    R[:, _TRUNK + _SHOULDERS] = turned(deviation.trunk[None], sway.trunk_rad)
    R[:, [Joint.HIPS]] = turned(deviation.pelvis[None], sway.trunk_rad / 2.0)
    R[:, [Joint.HEAD]] = turned(deviation.head[None], sway.ends_rad)
    R[:, _HANDS] = turned(deviation.hands, sway.ends_rad)
    R[:, _ARMS] = turned(deviation.arms, sway.arms_rad)[:, :, None]
    p_hips = np.array([0.0, 1.0, 0.0]) + np.zeros((n, 3))
    p_hips[:, [0, 2]] += smooth_noise(rng, times, 2, sway.hips_m)
    return _standing("t_pose", rate_hz, p_hips, R)


def _standing(name: str, rate_hz: float, p_hips: Array, R: Array) -> Motion:
    """The motion of these world rotations with the legs put on the feet's resting places."""
    ankles = _standing_ankles()
    hips = plant(p_hips, R[:, 0], ankles)
    straight = np.broadcast_to(np.eye(3), (len(R), 2, 2, 3, 3))
    R[:, LEGS[:, :2]] = rotations_to_ankles(hips, R[:, 0], ankles, straight)
    R_local = local_rotations(R)
    p_toes = forward_kinematics(R_local, hips)[0][:, LEGS[:, 3]]
    return Motion(name, "simulated", rate_hz, hips, R_local, p_toes, 1.0)


def _standing_ankles() -> Array:
    whole = np.broadcast_to(np.eye(3), (22, 3, 3))
    return np.asarray(forward_kinematics(whole, STANDARD_OFFSETS[0])[0][LEGS[:, 2]])
