"""Analytic two-bone IK: arm and leg as a triangle of two fixed sides."""

import numpy as np

from lobstr_hw.ik.vectors import align, cross, dot, length, perpendicular, swing, turn, unit
from lobstr_hw.rotations import Array

__all__ = ["bend_and_swing", "limb_rotations", "solve_two_bone", "stretch_towards"]


def solve_two_bone(
    p_root: Array,
    p_end_target: Array,
    length_upper: Array | float,
    length_lower: Array | float,
    pole: Array,
) -> Array:
    """Where the mid joint (knee, elbow) goes so that the end meets its target.

    The bones are never stretched: a target out of reach is approached along the line to it, so the
    end is at ``p_mid + length_lower * unit(p_end_target - p_mid)`` in every case.

    Args:
        p_root: hip or shoulder (..., 3).
        p_end_target: wanted place of the ankle or wrist (..., 3).
        length_upper: of the bone from root to mid (...), metres.
        length_lower: of the bone from mid to end.
        pole: direction (..., 3) to which the mid joint points; any length, need not be at right
            angles to the line from root to target; where it is parallel to that line, some
            direction at right angles is taken.

    Returns:
        p_mid (..., 3).
    """
    upper = np.asarray(length_upper, dtype=np.float64)[..., None]
    lower = np.asarray(length_lower, dtype=np.float64)[..., None]
    line = p_end_target - p_root
    axis = unit(np.where(length(line) > 1e-9, line, [0.0, -1.0, 0.0]))
    reach = np.clip(length(line), np.abs(upper - lower), upper + lower)
    # law of cosines: how far along the line, and how far beside it, the mid joint stands
    along = (reach**2 + upper**2 - lower**2) / (2.0 * np.maximum(reach, 1e-9))
    along = np.clip(along, -upper, upper)
    beside = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    return np.asarray(p_root + along * axis + beside * _across(pole, axis))


def _across(pole: Array, axis: Array) -> Array:
    """Unit vector at right angles to ``axis``, on the side of ``pole``."""
    side = perpendicular(pole, axis)
    least = np.eye(3)[np.argmin(np.abs(axis), axis=-1)]
    return unit(np.where(length(side) > 1e-9 * length(pole), side, perpendicular(least, axis)))


def limb_rotations(
    p_root: Array,
    p_mid: Array,
    p_end_target: Array,
    bones: tuple[Array, Array],
    hinge: Array,
    to_hinge: Array,
) -> tuple[Array, Array]:
    """World rotations of the two bones of a limb.

    Args:
        p_root: (..., 3).
        p_mid: of :func:`solve_two_bone`.
        p_end_target: may be out of reach.
        bones: offset of the mid joint in the upper bone's frame and of the end in the lower's.
        hinge: the bending axis in the bones' own frames (..., 3).
        to_hinge: the bending axis in the world (..., 3).

    Returns:
        R_upper, R_lower (..., 3, 3).
    """
    to_upper, to_lower = unit(p_mid - p_root), unit(p_end_target - p_mid)
    to_bones = np.stack([to_upper, to_lower], axis=0)
    R = align(np.stack(bones, axis=0), hinge, to_bones, to_hinge)
    return R[0], R[1]


def bend_and_swing(
    upper: Array, lower: Array, hinge: Array, to_end: Array
) -> tuple[Array, Array, Array]:
    """Bend a posed limb about its own hinge, then swing it, until its end meets a target.

    The posed limb keeps whatever else its pose holds (a twist of the shin, the knee's plane): the
    closed form of two-bone IK for a limb that has a pose already. Of the two ways to bend it takes
    the one in which the angle about the hinge is positive.

    Args:
        upper: the first bone in the world as posed (..., 3).
        lower: the second one.
        hinge: unit axis of the mid joint in the world (..., 3).
        to_end: wanted vector from root to end (..., 3).

    Returns:
        ``R_bend`` to apply to the lower bone first, ``R_swing`` to apply to both bones then
        (..., 3, 3), and the end reached, relative to the root (..., 3).
    """
    a, b = perpendicular(upper, hinge), perpendicular(lower, hinge)
    now = np.arctan2(dot(cross(a, b), hinge), dot(a, b))
    # |upper + lower|^2 = |upper|^2 + |lower|^2 + 2 (along the hinge) + 2 |a||b| cos(bend)
    fixed = dot(upper, upper) + dot(lower, lower) + 2.0 * dot(upper, hinge) * dot(lower, hinge)
    radius = np.maximum(2.0 * length(a) * length(b), 1e-12)
    cosine = (dot(to_end, to_end) - fixed) / radius
    bend = np.arccos(np.clip(cosine, -1.0, 1.0))
    R_bend = turn(hinge * (bend - now))
    posed = upper + (R_bend @ lower[..., None])[..., 0]
    R_swing = swing(unit(posed), unit(to_end))
    return R_bend, R_swing, (R_swing @ posed[..., None])[..., 0]


def stretch_towards(bone: Array, line: Array, reach: Array, most: float) -> Array:
    """The turn of a posed first bone that brings an end just out of reach of the rest into it.

    With the angle b between bone and line, the rest spans to the end where
    |line|^2 + |bone|^2 - 2 |line| |bone| cos b is at most the square of its reach. No turn is
    made for an end that is in reach already.

    Args:
        bone: as posed, in the world (..., 3).
        line: from its root to the wanted end (..., 3).
        reach: length of the rest, stretched (..., 1).
        most: radians that the bone may turn.

    Returns:
        R (..., 3, 3), to apply to the bone.
    """
    axis = cross(bone, line)
    sine = length(axis)
    cosine = 0.5 * (dot(line, line) + dot(bone, bone) - reach**2)
    cosine = cosine / np.maximum(length(bone) * length(line), 1e-9)
    wanted = np.arccos(np.clip(cosine, -1.0, 1.0))
    angle = np.clip(np.arctan2(sine, dot(bone, line)) - wanted, 0.0, most)
    return turn(axis / np.maximum(sine, 1e-9) * angle)
