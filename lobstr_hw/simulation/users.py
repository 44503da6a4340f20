"""A simulated person: their own proportions, and trackers strapped on where they happened to."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from lobstr_hw.poses import Pose
from lobstr_hw.proportions import (
    STANDARD_ARM,
    STANDARD_WIDTH,
    body_from_measures,
    eyes_in_head,
)
from lobstr_hw.rotations import Array, from_euler, rotation_y
from lobstr_hw.simulation.noise import random_rotations
from lobstr_hw.skeleton import STATURE, Body
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

__all__ = ["SimulatedUser", "drawn_body", "drawn_mounts", "ideal_mounts"]

HIPS_OF_STATURE = 1.0 / STATURE  # 0.586
EYES_OF_STATURE = 0.936
_LEG_DEVIATION, _ARM_DEVIATION = 0.025, 0.03  # of people with the same stature (design.md 4)
_SMALLEST_M, _LARGEST_M = 1.50, 1.95


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedUser:
    """Who wears the trackers, and how.

    Attributes:
        stature_m: with the measures of the body following from it, each with its own deviation.
        body: n = 1.
        mounts: T_joint_tracker of each role.
        T_tracking_play: from the world of the motion to the tracking space; a turn about Y.
        serials: of each role's tracker.
    """

    stature_m: float
    body: Body
    mounts: Mapping[TrackerRole, Pose]
    T_tracking_play: Pose = field(default_factory=Pose.identity)
    serials: Mapping[TrackerRole, str] = field(default_factory=dict)


def drawn_body(rng: np.random.Generator, stature_m: float | None = None) -> tuple[float, Body]:
    """A stature of 1.50 to 1.95 m (or the one given) and a body that is no scaled copy.

    Legs, arms and shoulders differ from the mean person of this stature independently.
    """
    drawn = rng.uniform(_SMALLEST_M, _LARGEST_M)
    leg, arm, width = 1.0 + rng.normal(0.0, 1.0, 3) * (
        _LEG_DEVIATION,
        _ARM_DEVIATION,
        _ARM_DEVIATION,
    )
    stature = drawn if stature_m is None else stature_m
    size = stature / STATURE
    hips = HIPS_OF_STATURE * stature * leg
    eyes = float(eyes_in_head(np.array(stature))[1])
    trunk = EYES_OF_STATURE * stature - eyes - hips
    measures = (hips, trunk, STANDARD_ARM * size * arm, STANDARD_WIDTH * size * width)
    return stature, body_from_measures(*(np.array([m]) for m in measures))


def ideal_mounts(stature_m: float = STATURE) -> dict[TrackerRole, Pose]:
    """Devices that sit straight: the headset at the eyes, wands in the fists, tracker on the belly.

    Devices face -Z, so each is a half turn about Y from its joint.
    """
    about = rotation_y(np.pi)
    return {
        TrackerRole.HEAD: Pose(about, eyes_in_head(np.array(stature_m))),
        TrackerRole.LEFT_HAND: Pose(about, np.array([0.08, 0.0, 0.06])),
        TrackerRole.RIGHT_HAND: Pose(about, np.array([-0.08, 0.0, 0.06])),
        TrackerRole.PELVIS: Pose(about, np.array([0.0, 0.02, 0.115])),
    }


def drawn_mounts(rng: np.random.Generator, stature_m: float = STATURE) -> dict[TrackerRole, Pose]:
    """Where one person straps them on.

    The headset's frame sits within pitch 5, yaw 3, roll 2 degrees (standard deviations) near the
    eyes; a wand is about 10 cm off the wrist, turned any way; the belly tracker 8 to 15 cm in front
    of the hips joint, turned any way.
    """
    pitch, yaw, roll = np.deg2rad([5.0, 3.0, 2.0]) * rng.normal(size=3)
    head = from_euler("YXZ", np.array([yaw, pitch, roll])) @ rotation_y(np.pi)
    eyes = eyes_in_head(np.array(stature_m)) + rng.normal(0.0, 1.0, 3) * (0.003, 0.008, 0.010)
    wands = [_wand(rng, side) for side in (1.0, -1.0)]
    belly = np.array([rng.normal(0.0, 0.012), rng.uniform(-0.03, 0.07), rng.uniform(0.08, 0.15)])
    R = random_rotations(rng, 3)
    poses = (Pose(head, eyes), Pose(R[0], wands[0]), Pose(R[1], wands[1]), Pose(R[2], belly))
    return dict(zip(FOUR_POINTS, poses, strict=True))


def _wand(rng: np.random.Generator, side: float) -> Array:
    """The grip lies 8 cm along the hand; the device's origin a few centimetres across from it."""
    along = rng.normal(0.08, 0.01)
    across, angle = rng.uniform(0.03, 0.08), rng.uniform(0.0, 2.0 * np.pi)
    return np.array([side * along, across * np.cos(angle), across * np.sin(angle)])
