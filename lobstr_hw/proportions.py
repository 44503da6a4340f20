"""A body from a few measures: how the standard skeleton is stretched to a person.

Legs follow the hips' height, the trunk what is left of the stature, the arms their own length.
"""

import numpy as np

from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import EYES, STANDARD_OFFSETS, STATURE, TOE_BASE_HEIGHT, Body, Joint

__all__ = ["STANDARD_ARM", "STANDARD_TRUNK", "STANDARD_WIDTH", "body_from_measures", "eyes_in_head"]

_TRUNK = (Joint.SPINE, Joint.CHEST, Joint.UPPER_CHEST, Joint.NECK, Joint.HEAD)
_SHOULDERS = (
    Joint.LEFT_SHOULDER,
    Joint.RIGHT_SHOULDER,
    Joint.LEFT_UPPER_ARM,
    Joint.RIGHT_UPPER_ARM,
)
_ARMS = (Joint.LEFT_LOWER_ARM, Joint.RIGHT_LOWER_ARM, Joint.LEFT_HAND, Joint.RIGHT_HAND)

STANDARD_TRUNK = float(sum(STANDARD_OFFSETS[j, 1] for j in _TRUNK))
"""From the hips to the skull base."""
STANDARD_ARM = float(sum(STANDARD_OFFSETS[j, 0] for j in (Joint.LEFT_LOWER_ARM, Joint.LEFT_HAND)))
"""From the shoulder joint to the wrist."""
STANDARD_WIDTH = 2.0 * float(sum(STANDARD_OFFSETS[j, 0] for j in _SHOULDERS[::2]))
"""From shoulder joint to shoulder joint."""


def body_from_measures(
    hips_height_m: Array, trunk_m: Array, arm_m: Array, shoulders_m: Array
) -> Body:
    """The standard skeleton, stretched part by part.

    Args:
        hips_height_m: (n,) of the hips joint over the soles; all of the legs scale with it.
        trunk_m: (n,) hips to skull base, standing straight.
        arm_m: (n,) shoulder joint to wrist.
        shoulders_m: (n,) from one shoulder joint to the other.
    """
    hips, trunk, arm, width = (
        np.asarray(v, dtype=np.float64)[:, None, None]
        for v in (hips_height_m, trunk_m, arm_m, shoulders_m)
    )
    offsets = STANDARD_OFFSETS * hips
    offsets[:, _TRUNK] = STANDARD_OFFSETS[_TRUNK, :] * (trunk / STANDARD_TRUNK)
    offsets[:, _ARMS] = STANDARD_OFFSETS[_ARMS, :] * (arm / STANDARD_ARM)
    # sideways with the width, upwards with the trunk that carries them
    sideways = STANDARD_OFFSETS[_SHOULDERS, :] * np.array([1.0, 0.0, 0.0])
    upwards = STANDARD_OFFSETS[_SHOULDERS, :] - sideways
    offsets[:, _SHOULDERS] = sideways * (width / STANDARD_WIDTH) + upwards * (
        trunk / STANDARD_TRUNK
    )
    height = np.asarray(hips_height_m, dtype=np.float64)
    return Body(offsets, TOE_BASE_HEIGHT * height, 1.0 / height)


def eyes_in_head(stature_m: Array) -> Array:
    """Point between the eyes in the head's frame (n, 3): a head grows with the stature."""
    return np.asarray(EYES * (np.asarray(stature_m) / STATURE)[..., None])
