"""The standard skeleton and forward kinematics (docs/conventions.md).

In the T-pose every joint frame is parallel to the world; the figure faces +Z, its left hand at +X.
Offsets are in metres for hips at 1.0 m.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from lobstr_hw.poses import frozen
from lobstr_hw.rotations import Array

__all__ = [
    "EYES",
    "GRIP",
    "HEEL",
    "HUMANOID_NAMES",
    "MIRRORED",
    "PARENTS",
    "SKELETON_VERSION",
    "STANDARD_OFFSETS",
    "STATURE",
    "TOE_BASE_HEIGHT",
    "TOE_TIP",
    "Body",
    "Joint",
    "forward_kinematics",
    "global_rotations",
    "local_rotations",
    "mirror_points",
    "mirror_rotations",
]

SKELETON_VERSION = 1
"""Frozen with the features: another version means other weights."""


class Joint(IntEnum):
    """The 22 joints, parents before children; the words are Unity's HumanBodyBones."""

    HIPS = 0
    SPINE = 1
    CHEST = 2
    UPPER_CHEST = 3
    NECK = 4
    HEAD = 5
    LEFT_SHOULDER = 6
    LEFT_UPPER_ARM = 7
    LEFT_LOWER_ARM = 8
    LEFT_HAND = 9
    RIGHT_SHOULDER = 10
    RIGHT_UPPER_ARM = 11
    RIGHT_LOWER_ARM = 12
    RIGHT_HAND = 13
    LEFT_UPPER_LEG = 14
    LEFT_LOWER_LEG = 15
    LEFT_FOOT = 16
    LEFT_TOES = 17
    RIGHT_UPPER_LEG = 18
    RIGHT_LOWER_LEG = 19
    RIGHT_FOOT = 20
    RIGHT_TOES = 21


HUMANOID_NAMES = tuple(j.name.replace("_", " ").title().replace(" ", "") for j in Joint)
"""The names outside (BVH, VMC, glTF, NDJSON): Hips, LeftUpperLeg, ..."""

PARENTS = (-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 3, 10, 11, 12, 0, 14, 15, 16, 0, 18, 19, 20)

_LEFT_HALF = {
    Joint.HIPS: (0.0, 1.0, 0.0),
    Joint.SPINE: (0.0, 0.080, 0.0),
    Joint.CHEST: (0.0, 0.110, 0.0),
    Joint.UPPER_CHEST: (0.0, 0.120, 0.0),
    Joint.NECK: (0.0, 0.135, 0.0),
    Joint.HEAD: (0.0, 0.090, 0.0),
    Joint.LEFT_SHOULDER: (0.025, 0.095, 0.0),
    Joint.LEFT_UPPER_ARM: (0.145, -0.010, 0.0),
    Joint.LEFT_LOWER_ARM: (0.280, 0.0, 0.0),
    Joint.LEFT_HAND: (0.245, 0.0, 0.0),
    Joint.LEFT_UPPER_LEG: (0.090, -0.097, 0.0),
    Joint.LEFT_LOWER_LEG: (0.0, -0.430, 0.0),
    Joint.LEFT_FOOT: (0.0, -0.410, 0.0),
    Joint.LEFT_TOES: (0.0, -0.043, 0.120),
}

MIRRORED = tuple(
    Joint[j.name.replace("LEFT", "*").replace("RIGHT", "LEFT").replace("*", "RIGHT")].value
    for j in Joint
)
"""For each joint, its partner on the other side of the body."""

_MIRROR_X = np.array([-1.0, 1.0, 1.0])

STANDARD_OFFSETS: Array = frozen(
    np.array(
        [
            _LEFT_HALF[j] if j in _LEFT_HALF else _MIRROR_X * _LEFT_HALF[Joint(MIRRORED[j])]
            for j in Joint
        ]
    ),
    (22, 3),
)
"""Each joint in its parent (22, 3); the hips in the world, standing."""

STATURE = 1.706
TOE_BASE_HEIGHT = 0.020
"""Of the toe base over the floor in flat stance; the sole is this far below it."""

EYES: Array = frozen(np.array([0.0, 0.062, 0.095]), (3,))
GRIP: Array = frozen(np.array([0.080, 0.0, 0.0]), (3,))
HEEL: Array = frozen(np.array([0.0, -0.063, -0.045]), (3,))
TOE_TIP: Array = frozen(np.array([0.0, -0.010, 0.060]), (3,))
"""Points that are no joints: eyes in head, grip in left hand, heel in foot, tip in toes."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """One or more people's sizes.

    Attributes:
        offsets: (n, 22, 3) each joint in its parent, in the user's metres.
        sole: (n,) height of the toe base over the floor in flat stance.
        scale: (n,) s = 1.0 / hips height; times s, the user's lengths are the standard skeleton's.
    """

    offsets: Array
    sole: Array
    scale: Array

    def __post_init__(self) -> None:
        """Check the shapes once."""
        object.__setattr__(self, "offsets", frozen(self.offsets, (22, 3)))
        n = self.offsets.shape[:1]
        object.__setattr__(self, "sole", frozen(self.sole, n))
        object.__setattr__(self, "scale", frozen(self.scale, n))

    @staticmethod
    def standard(n: int = 1, hips_height_m: float = 1.0) -> "Body":
        """The standard skeleton, n times, scaled to a height of the hips."""
        size = np.full(n, hips_height_m)
        offsets = STANDARD_OFFSETS * size[:, None, None]
        return Body(offsets, TOE_BASE_HEIGHT * size, 1.0 / size)

    def scaled_to_standard(self) -> "Body":
        """The same proportions with the hips at 1.0 m, where prediction, contact and IK work."""
        s = self.scale
        return Body(self.offsets * s[:, None, None], self.sole * s, np.ones_like(s))


def global_rotations(R_local: Array) -> Array:
    """Local (..., 22, 3, 3) -> world rotations."""
    out = np.empty_like(R_local)
    for joint, parent in enumerate(PARENTS):
        local = R_local[..., joint, :, :]
        out[..., joint, :, :] = local if parent < 0 else out[..., parent, :, :] @ local
    return out


def local_rotations(R_world: Array) -> Array:
    """World (..., 22, 3, 3) -> local rotations."""
    parents = R_world[..., PARENTS[1:], :, :]
    out = np.array(R_world)
    out[..., 1:, :, :] = np.swapaxes(parents, -1, -2) @ R_world[..., 1:, :, :]
    return out


def forward_kinematics(
    R_local: Array, p_hips: Array, offsets: Array = STANDARD_OFFSETS
) -> tuple[Array, Array]:
    """Joint positions and rotations in the world.

    Args:
        R_local: each joint in its parent, the hips in the world (..., 22, 3, 3).
        p_hips: (..., 3) metres.
        offsets: (22, 3) or (..., 22, 3); row 0 is not used.

    Returns:
        p_world (..., 22, 3), R_world (..., 22, 3, 3).
    """
    R = global_rotations(R_local)
    steps = (R[..., PARENTS[1:], :, :] @ np.asarray(offsets)[..., 1:, :, None])[..., 0]
    p = np.empty((*R.shape[:-3], 22, 3))
    p[..., 0, :] = p_hips
    for joint, parent in enumerate(PARENTS[1:], start=1):
        p[..., joint, :] = p[..., parent, :] + steps[..., joint - 1, :]
    return p, R


def mirror_points(p: Array) -> Array:
    """Left and right exchanged about the plane x = 0: joint positions (..., 22, 3)."""
    return np.asarray(p[..., MIRRORED, :] * _MIRROR_X)


def mirror_rotations(R: Array) -> Array:
    """Left and right exchanged: joint rotations (..., 22, 3, 3), local or world."""
    return np.asarray(R[..., MIRRORED, :, :] * np.outer(_MIRROR_X, _MIRROR_X))
