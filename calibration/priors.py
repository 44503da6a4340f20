"""What is known about people and devices before anybody is measured.

One T-pose gives twelve coordinates and four rotations; a body and four mounts have more unknowns
than that. What it does not give comes from here: means and standard deviations of normal
distributions (design.md 4). All are of the person, so they are multiplied by the size where that
says so, and every number has its reason.
"""

import numpy as np

from lobstr_hw.poses import frozen
from lobstr_hw.rotations import Array, rotation_y

__all__ = [
    "ARM_DEVIATION",
    "ARM_LIFT_DEVIATIONS",
    "BELLY_LEVER",
    "BELLY_LEVER_DEVIATION",
    "EYES_DEVIATION",
    "EYES_OF_STATURE",
    "HEADSET_DEVIATION",
    "HIPS_OF_STATURE",
    "IDEAL_DEVICE",
    "LEG_DEVIATION",
    "POSE_DEVIATION",
    "TRUNK_DEVIATION",
    "WAND_LEVER",
    "WAND_LEVER_DEVIATION",
]

EYES_OF_STATURE = 0.936
HIPS_OF_STATURE = 0.586
LEG_DEVIATION = 0.025
"""Of the hips' height among people of one stature, as a fraction."""
ARM_DEVIATION = 0.03
"""Of the arms (and of the shoulders' width) among people of one stature, as a fraction."""

POSE_DEVIATION = np.deg2rad(3.5)
"""About each axis, of a segment that stands off the T-pose by up to 10 degrees about any axis."""
ARM_LIFT_DEVIATIONS: Array = frozen(np.deg2rad([6.0, 4.0]), (2,))
"""Of an arm's direction, up and forward: in recorded T-poses arms droop by up to 19 degrees."""
TRUNK_DEVIATION = np.deg2rad(1.5)
"""Of the back against the vertical; people feel this one better than their arms."""

IDEAL_DEVICE: Array = frozen(rotation_y(np.pi), (3, 3))
"""R_joint_tracker of a headset that sits straight: devices face -Z, joints +Z."""
HEADSET_DEVIATION: Array = frozen(np.deg2rad([5.0, 3.0, 2.0]), (3,))
"""Of a headset's frame in the head: pitch, yaw, roll."""
EYES_DEVIATION: Array = frozen(np.array([0.004, 0.010, 0.012]), (3,))
"""Of the headset's origin about the point between the eyes, metres."""

WAND_LEVER: Array = frozen(np.array([0.080, 0.0, 0.0]), (3,))
"""From the left wrist to the wand's origin: the grip; a wand is some 10 cm off the wrist."""
WAND_LEVER_DEVIATION: Array = frozen(np.array([0.015, 0.040, 0.040]), (3,))
"""Across the hand the origin lies 3 to 8 cm off, on a side that nobody knows."""

BELLY_LEVER: Array = frozen(np.array([0.0, 0.020, 0.115]), (3,))
"""From the hips joint to a tracker on the belt: 8 to 15 cm in front."""
BELLY_LEVER_DEVIATION: Array = frozen(np.array([0.015, 0.045, 0.020]), (3,))
"""Sideways a belt is centred; upwards it sits where its owner likes it."""
