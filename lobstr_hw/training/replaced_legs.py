"""Legs put under hips that were moved, their feet at new places: what makes new motion of old."""

import numpy as np

from lobstr_hw.features import POINT_ROLES, reference_frames
from lobstr_hw.ik.vectors import rotate
from lobstr_hw.lower_body import leg_points_in_reference, pose_6d
from lobstr_hw.rotations import Array, rotation_y, transpose
from lobstr_hw.simulation.legs import LEG_M, rotations_to_ankles, sockets
from lobstr_hw.trackers import TrackerRole

__all__ = ["HIPS", "STRETCHED", "ankles_of", "apart", "can_reach", "pose_to_ankles"]

HIPS = POINT_ROLES.index(TrackerRole.PELVIS)
STRETCHED, FOLDED = 0.995, 0.28
"""Shares of a leg between which hip and ankle may be apart."""


def ankles_of(p: Array, R: Array, joints: Array) -> Array:
    """Both ankles (frames, 2, 3) in the world.

    Args:
        p: (frames, 4, 3) the points of the features, world, standard skeleton.
        R: (frames, 4, 3, 3).
        joints: (frames, 2, 4, 3, 3) of the network.
    """
    R_ref = reference_frames(R[:, HIPS])[:, None]
    return np.asarray(p[:, None, HIPS] + rotate(R_ref, leg_points_in_reference(joints)[:, :, 2]))


def apart(p: Array, R: Array, ankles: Array) -> Array:
    """From hip joint to ankle (frames, 2), in leg's lengths."""
    return np.asarray(np.linalg.norm(ankles - sockets(p[:, HIPS], R[:, HIPS]), axis=-1) / LEG_M)


def can_reach(apart: Array, before: Array) -> bool:
    """Whether legs can be so long (frames, 2), given how long they were.

    Some captures' legs are a little longer than the standard's: they may stay as they were.
    """
    most = np.maximum(STRETCHED, before) + 1e-9
    return bool((apart <= most).all() and (apart >= FOLDED).all())


def pose_to_ankles(
    joints: Array, R_ref: Array, p: Array, R: Array, ankles: Array, splay: Array | float = 0.0
) -> Array:
    """The 48 numbers (frames, 48) of legs to new ankles under new hips; feet turn as they did.

    Args:
        joints: (frames, 2, 4, 3, 3) as they were.
        R_ref: (frames, 1, 3, 3) as they were.
        p: (frames, 4, 3) as they are now.
        R: (frames, 4, 3, 3) likewise.
        ankles: (frames, 2, 3) likewise.
        splay: (frames,) of the knees outwards, radians.
    """
    upper = R_ref @ joints[:, :, 0] @ joints[:, :, 1]
    lower = upper @ joints[:, :, 2]
    foot = lower @ joints[:, :, 3]
    turn = np.broadcast_to(splay, len(joints))
    out = np.stack([rotation_y(turn), rotation_y(-turn)], axis=1)[:, :, None]
    legs = rotations_to_ankles(p[:, HIPS], R[:, HIPS], ankles, out @ np.stack([upper, lower], 2))
    C = transpose(reference_frames(R[:, HIPS])) @ R[:, HIPS]
    to_hips = transpose(R[:, HIPS])[:, None]
    upper, lower = legs[:, :, 0], legs[:, :, 1]
    parts = (
        np.broadcast_to(C[:, None], upper.shape),
        to_hips @ upper,
        transpose(upper) @ lower,
        transpose(lower) @ foot,
    )
    return pose_6d(np.stack(parts, axis=2))
