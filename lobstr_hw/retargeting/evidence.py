"""What a subject's clips show about the body: when it walks upright, when a foot stands flat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobstr_hw.retargeting.source import LEGS, SourceClip
from lobstr_hw.retargeting.speed import speed
from lobstr_hw.rotations import Array, angle_between, normalize
from lobstr_hw.skeleton import Joint

__all__ = ["LEAST_WALK_S", "RATE_HZ", "Bools", "Evidence", "flat_stance", "gather", "trunk_line"]

Bools = npt.NDArray[np.bool_]

RATE_HZ = 15.0  # poses further apart than this say nothing new
_WALK_M_S = (0.4, 2.2)
LEAST_WALK_S = 1.0  # a whole stride
_LEAST_UPRIGHT_S = 0.5
_LEAN = np.radians(15.0)
_STILL_M_S = 0.15
_FLAT_M = 0.020
_STANDING_M = 0.65


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Poses of one subject, thinned out.

    Attributes:
        p: (F, 22, 3) joints, standard size.
        R: (F, 22, 3, 3) the rig's frames.
        upright: (F,) walking forward upright, or standing where there is too little walking.
        flat: (F, 2) a foot stands flat and still.
        low: (F, 2) a foot is about as low as it gets: where it never stands flat for long.
        walking_s: seconds of walking forward upright.
        notes: what there was too little of.
    """

    p: Array
    R: Array
    upright: Bools
    flat: Bools
    low: Bools
    walking_s: float
    notes: tuple[str, ...]


def gather(clips: Sequence[SourceClip]) -> Evidence:
    """Thin out, join, and find the walking and standing frames."""
    parts = [_part(clip) for clip in clips]
    p, R, flat, low, forward, height = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    tall = height > 0.94 * np.percentile(height, 95.0)
    lean = angle_between(trunk_line(p), np.array([0.0, 1.0, 0.0]))
    walking, notes = tall & forward & (lean < _LEAN), []
    if walking.sum() < LEAST_WALK_S * RATE_HZ:
        walking = tall & forward
    walking_s = float(walking.sum() / RATE_HZ)
    if walking_s < LEAST_WALK_S:
        notes.append(f"{walking_s:.1f} s of walking upright")
        walking = tall & (lean < 2.0 * _LEAN)
    if walking.sum() < _LEAST_UPRIGHT_S * RATE_HZ:
        notes.append("no upright pose")
        walking = np.zeros_like(walking)
    return Evidence(p, R, walking, flat, low, walking_s, tuple(notes))


def _part(clip: SourceClip) -> tuple[Array, Array, Bools, Bools, Bools, Array]:
    centre = clip.hip_centre()
    v = speed(centre, clip.rate_hz, 0.5)
    side = clip.p[:, Joint.LEFT_UPPER_LEG] - clip.p[:, Joint.RIGHT_UPPER_LEG]
    ahead = normalize(np.cross(side, [0.0, 1.0, 0.0]) * [1.0, 0.0, 1.0])
    along = np.sum(v * ahead, axis=-1)
    across = np.hypot(v[:, 0], v[:, 2])
    lowest = clip.p[:, [leg[3] for leg in LEGS], 1].min(axis=1)
    forward = (along > 0.85 * across) & (along > _WALK_M_S[0]) & (along < _WALK_M_S[1])
    thin = slice(0, None, max(1, round(clip.rate_hz / RATE_HZ)))
    flat = flat_stance(clip)
    height = centre[:, 1] - lowest
    low = _low(clip)
    return clip.p[thin], clip.R[thin], flat[thin], low[thin], forward[thin], height[thin]


def trunk_line(p: Array) -> Array:
    """From the middle of the hip joints to the middle of the shoulder joints: (F, 3)."""
    shoulders = p[:, Joint.LEFT_UPPER_ARM] + p[:, Joint.RIGHT_UPPER_ARM]
    return np.asarray(0.5 * (shoulders - p[:, Joint.LEFT_UPPER_LEG] - p[:, Joint.RIGHT_UPPER_LEG]))


def flat_stance(clip: SourceClip) -> Bools:
    """Frames (F, 2) in which ankle and toe base are still and as high as they are in most stances.

    A still ankle over a still toe base is a foot flat on the floor, unless the person sits or lies:
    these frames are left out, and so are heights off the median of the rest (a step, a bench).
    """
    ankles, toes = [leg[2] for leg in LEGS], [leg[3] for leg in LEGS]
    heights = [clip.p[:, joints, 1] for joints in (ankles, toes)]  # (F, 2) each
    still = np.all([_still(clip, joints) for joints in (ankles, toes)], axis=0)
    stands = clip.hip_centre()[:, 1] - heights[1].min(axis=1) > _STANDING_M
    still &= stands[:, None]
    for height in heights:
        if still.any():
            still &= np.abs(height - np.median(height[still])) < _FLAT_M
    return np.asarray(still)


def _low(clip: SourceClip) -> Bools:
    """Frames (F, 2) in which ankle and toe base are both in the lower third of their heights."""
    out = np.ones((len(clip), 2), dtype=bool)
    for k in (2, 3):
        height = clip.p[:, [leg[k] for leg in LEGS], 1]
        out &= height <= np.percentile(height, 33.0, axis=0)
    return out


def _still(clip: SourceClip, joints: list[Joint]) -> Bools:
    v = speed(clip.p[:, joints], clip.rate_hz, 0.1)
    return np.asarray(np.linalg.norm(v, axis=-1) < _STILL_M_S)
