"""What magnetic trackers share: the axes of their source, and inches."""

import numpy as np

from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array, from_quat_xyzw

__all__ = ["METRES_PER_INCH", "axis_vector", "is_unit", "signed_axis", "source_axes", "world_pose"]

METRES_PER_INCH = 0.0254
UNIT_TOLERANCE = 0.02
"""A quaternion further from length 1 is no quaternion: what resynchronisation rests on."""


def signed_axis(text: str) -> str:
    """An axis of the source: x, y, z, -x, -y or -z.

    Raises:
        ValueError: anything else.
    """
    if text.removeprefix("-") not in ("x", "y", "z"):
        raise ValueError(f"{text!r} is not one of x, y, z, -x, -y, -z")
    return text


def axis_vector(axis: str) -> Array:
    """Its unit vector (3,) in the source's frame."""
    sign = -1.0 if axis.startswith("-") else 1.0
    return np.asarray(sign * np.eye(3)["xyz".index(axis[-1])])


def source_axes(up: str) -> Array:
    """``R_world_source`` (3, 3) for a source whose axis ``up`` points to the ceiling.

    The source's X, or its Y where X is vertical, becomes -Z of the world, where devices face
    (docs/conventions.md); which way the person faces is found by the calibration.
    """
    u = axis_vector(up)
    forward = axis_vector("y" if up.endswith("x") else "x")
    return np.stack([np.cross(forward, u), u, -forward])  # rows: the world's axes in the source's


def world_pose(R_world_source: Array, p_m: Array, quat_wxyz: Array) -> PartialPose:
    """A sensor's pose in our world.

    Args:
        R_world_source: (3, 3), from source_axes.
        p_m: (3,) metres, in the source's frame.
        quat_wxyz: (4,) sensor to source; identity when the sensor is parallel to the source.
    """
    R = from_quat_xyzw(np.roll(quat_wxyz, -1))
    return PartialPose(R_world_source @ R @ R_world_source.T, R_world_source @ p_m)


def is_unit(quat: Array) -> bool:
    """Whether four numbers can be a rotation."""
    return bool(np.isfinite(quat).all()) and abs(float(quat @ quat) - 1.0) < UNIT_TOLERANCE
