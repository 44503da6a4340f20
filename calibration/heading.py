"""Where a person in a T-pose faces, and how each tracker stands in its joint."""

import numpy as np

from lobstr_hw.calibration.priors import (
    HEADSET_DEVIATION,
    IDEAL_DEVICE,
    POSE_DEVIATION,
)
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    heading_angle,
    to_rotation_vector,
    transpose,
)

__all__ = [
    "HANDS_DEVIATION",
    "STRANGE",
    "hands_heading",
    "head_mount",
    "headset_heading",
    "pose_heading",
    "turn_between",
]

HANDS_DEVIATION = np.deg2rad(2.6)
"""Two arms off by 3.5 degrees and two wands 4 cm across, 1.55 m apart."""
_HEADSET_DEVIATION = float(np.hypot(HEADSET_DEVIATION[1], POSE_DEVIATION))
_HEADING_DEVIATION = 1.0 / np.hypot(1.0 / HANDS_DEVIATION, 1.0 / _HEADSET_DEVIATION)
STRANGE = np.deg2rad(35.0)
"""Beyond this a headset's frame is not the one that the prior speaks of."""


def turn_between(a: Array | float, b: Array | float) -> Array:
    """From angle b to angle a the short way, in (-pi, pi]."""
    return np.asarray(np.angle(np.exp(1j * (np.asarray(a) - np.asarray(b)))))


def hands_heading(p_left: Array, p_right: Array) -> Array:
    """Yaw (...) at right angles to the line between two hands (..., 3)."""
    line = np.asarray(p_left) - np.asarray(p_right)
    return np.arctan2(-line[..., 2], line[..., 0])


def headset_heading(R_headset: Array) -> Array:
    """Yaw (...) of a head whose headset (..., 3, 3) sits straight."""
    return heading_angle(R_headset @ transpose(IDEAL_DEVICE))[0]


def pose_heading(p_left: Array, p_right: Array, R_headset: Array) -> tuple[float, float]:
    """Yaw of the person, and by how much the headset disagrees with the hands.

    The mean of both, weighted by what each can be off: arms and wands by 2.6 degrees, head and
    headset together by 4.6. A headset that looks elsewhere altogether is left out.
    """
    hands = float(hands_heading(p_left, p_right))
    disagreement = float(turn_between(headset_heading(R_headset), hands))
    if abs(disagreement) > STRANGE:
        return hands, disagreement
    weight = (_HEADING_DEVIATION / _HEADSET_DEVIATION) ** 2
    return float(turn_between(hands + weight * disagreement, 0.0)), disagreement


def head_mount(R_seen: Array) -> tuple[Array, Array]:
    """Split what a headset shows in a T-pose into how the head is held and how the headset sits.

    ``R_seen = R_head @ R_head_tracker``: both are near to what they should be, and the product is
    measured. For small angles the vectors add, and the most likely share of each axis goes by the
    variances. A device that no headset prior fits is taken at its word: the head is held straight.

    Args:
        R_seen: (3, 3) headset in the person's heading.

    Returns:
        R_head and R_head_tracker (3, 3).
    """
    off = to_rotation_vector(R_seen @ transpose(IDEAL_DEVICE))
    held = np.full(3, POSE_DEVIATION)
    held[1] = np.hypot(held[1], _HEADING_DEVIATION)
    share = HEADSET_DEVIATION**2 / (HEADSET_DEVIATION**2 + held**2)
    if np.linalg.norm(off) > STRANGE:
        share = np.ones(3)
    R_head_tracker = from_rotation_vector(share * off) @ IDEAL_DEVICE
    return R_seen @ transpose(R_head_tracker), R_head_tracker
