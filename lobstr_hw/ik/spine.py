"""Spine IK: hips and head are measured, the four joints between them are found in closed form.

The hips' and the head's rotations are kept exactly. From the spine joint, which the hips carry, to
the neck joint run three bones; they bend as an arc whose sagitta makes up for the chord being
shorter than the chain. Twist is shared along the chain; the neck takes the rest. Nothing iterates
and nothing is remembered: the same head over the same hips gives the same spine, and a small
movement of either gives a small movement of it, also when looking behind, bowing and crouching.

Decision on chains that do not fit: the hips stay where they are measured (the feet hang on them),
bones keep their length and the head its rotation; a head too far away is approached along the
line to it.
"""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.ik.two_bone import stretch_towards
from lobstr_hw.ik.vectors import (
    dot,
    faded_angle,
    length,
    perpendicular,
    rotate,
    sine_axis,
    swing,
    turn,
    twist_terms,
    unit,
)
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Joint

__all__ = ["SpineSettings", "solve_spine"]


@dataclass(frozen=True, slots=True)
class SpineSettings:
    """How the spine shares what lies between hips and head; angles in radians.

    The upper chest turns with the hands more than with the head: fitted on recorded people
    (docs/ik.md).

    Attributes:
        line: of chest per metre that the right hand is further forward than the left.
        middle: of chest per metre that the hands, added up, are to the left of the head.
        hands_limit: of chest that the hands alone can bring about.
        head: of chest per radian of the head's twist against the hips, looking a little aside.
        look_behind: the same for what the head's twist exceeds ``head_free``, softly.
        head_free: twist up to which the neck does nearly all.
        shares: of the upper chest's twist that spine, chest and upper chest have taken up.
        neck: share of the remaining turn towards the head that the neck takes.
        hunch: how much a spine that is too long for its chord prefers to bend backwards (as
            slouching people do) over following the pelvis' own tilt.
    """

    line: float = 0.45
    middle: float = 0.2
    hands_limit: float = 0.7
    head: float = 0.12
    look_behind: float = 0.35
    head_free: float = 0.9
    shares: tuple[float, float, float] = (0.4, 0.75, 1.0)
    neck: float = 0.4
    hunch: float = 0.35


def solve_spine(
    p_hips: Array,
    R_hips: Array,
    p_head: Array,
    R_head: Array,
    p_hand: Array,
    offsets: Array,
    settings: SpineSettings | None = None,
) -> Array:
    """World rotations of spine, chest, upper chest and neck.

    Args:
        p_hips: (n, 3) metres.
        R_hips: (n, 3, 3).
        p_head: (n, 3).
        R_head: (n, 3, 3).
        p_hand: left and right wrist (n, 2, 3).
        offsets: (n, 22, 3) of the body.
        settings: shares; the defaults if None.

    Returns:
        (n, 4, 3, 3). Under them the head joint is at ``p_head`` wherever the bones allow it.
    """
    settings = settings or SpineSettings()
    bones = offsets[:, Joint.CHEST : Joint.NECK + 1]  # of spine, chest, upper chest (n, 3, 3)
    p_spine = p_hips + rotate(R_hips, offsets[:, Joint.SPINE])
    torso = swing(R_hips[..., :, 1], unit(p_head - p_spine)) @ R_hips  # its Y along the trunk
    angle = _chest_twist(np.swapaxes(torso, -1, -2), R_head, p_hand - p_head[:, None], settings)
    R_neck = _neck(torso, angle, R_head, settings)
    neck = rotate(R_neck, offsets[:, Joint.HEAD])
    R_stretch = stretch_towards(neck, p_head - p_spine, length(bones).sum(axis=1), np.pi)
    R_neck = R_stretch @ R_neck
    chord = p_head - p_spine - rotate(R_stretch, neck)

    axis = unit(np.where(length(chord) > 1e-9, chord, torso[..., :, 1]))
    upright = swing(R_hips[..., :, 1], axis) @ R_hips  # the hips' frame, its Y along the chord
    directions = _arc(axis, length(chord), length(bones), _bulge(axis, R_hips, upright, settings))
    twisted = upright[:, None] @ turn(_about_y(angle[:, None] * np.array(settings.shares)))
    R = swing(unit(rotate(twisted, bones)), directions) @ twisted
    return np.concatenate([R, R_neck[:, None]], axis=1)


def _chest_twist(
    to_torso: Array, R_head: Array, from_head: Array, settings: SpineSettings
) -> Array:
    """Of the upper chest against the hips (n,), from the head's twist and the hands' places."""
    hand = rotate(to_torso[:, None], from_head)  # (n, 2, 3)
    ahead = settings.line * (hand[:, 1, 2] - hand[:, 0, 2])
    aside = settings.middle * (hand[:, 0, 0] + hand[:, 1, 0])
    by_hands = settings.hands_limit * np.tanh((ahead + aside) / settings.hands_limit)
    head = faded_angle(*twist_terms(to_torso @ R_head, axis=1))
    excess = head - settings.head_free * np.tanh(head / settings.head_free)
    return np.asarray(by_hands + settings.head * head + settings.look_behind * excess)


def _neck(torso: Array, angle: Array, R_head: Array, settings: SpineSettings) -> Array:
    below = torso @ turn(_about_y(angle))
    return np.asarray(below @ turn(settings.neck * sine_axis(np.swapaxes(below, -1, -2) @ R_head)))


def _about_y(angle: Array) -> Array:
    return np.asarray(angle[..., None] * np.array([0.0, 1.0, 0.0]))


def _bulge(axis: Array, R_hips: Array, upright: Array, settings: SpineSettings) -> Array:
    """Direction (n, 3) at right angles to the chord in which the arc bends out.

    An arc that leaves the pelvis along the pelvis' own Y bulges to Y's part across the chord. For
    a pelvis that tilts back against the chord that would be forwards, and on the way there the
    direction would pass through zero and snap. So the part along Z is kept behind the body.
    """
    across = perpendicular(R_hips[..., :, 1], axis)
    sideways = dot(across, upright[..., :, 0])
    back = settings.hunch - dot(across, upright[..., :, 2])
    back = 0.5 * (back + np.sqrt(back * back + 0.1))  # positive, and nearly ``back`` where large
    return unit(sideways * upright[..., :, 0] - back * upright[..., :, 2])


def _arc(axis: Array, chord: Array, lengths: Array, bulge: Array) -> Array:
    """Directions (n, 3, 3) of three bones of one bend, from the start of a chord to its end.

    The bones stand at angles phi + d, phi, phi - d to the chord, in the plane of axis and bulge.
    Their sum is as long as the chord where
    4 a c x^2 + 2 b (a + c) x + (a - c)^2 + b^2 - chord^2 = 0 with x = cos d and bones a, b, c.
    """
    a, b, c = lengths[:, 0], lengths[:, 1], lengths[:, 2]  # (n, 1)
    linear, constant = b * (a + c), (a - c) ** 2 + b**2 - chord**2
    root = np.sqrt(np.maximum(linear**2 - 4.0 * a * c * constant, 0.0))
    x = np.clip((root - linear) / (4.0 * a * c), 0.0, 1.0)
    d = np.arccos(x)
    phi = np.arctan2((c - a) * np.sin(d), (a + c) * x + b)
    angles = np.stack([phi + d, phi, phi - d], axis=1)  # (n, 3, 1)
    return np.asarray(np.cos(angles) * axis[:, None] + np.sin(angles) * bulge[:, None])
