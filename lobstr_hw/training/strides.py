"""Other people's strides and stances, made from those that were captured.

Whoever goes as fast as another takes longer steps or more of them, and stands wider or narrower.
The way over the floor is stretched, feet and all, and both feet are put further out or in; the hips
go as low as legs that bend as they did ask for. Feet that stood stand.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import pose_from_6d
from lobstr_hw.rotations import Array, heading_angle
from lobstr_hw.simulation.legs import LEG_M, sockets
from lobstr_hw.training.replaced_legs import (
    HIPS,
    STRETCHED,
    ankles_of,
    apart,
    can_reach,
    pose_to_ankles,
)

__all__ = ["Stride", "with_other_strides"]

Ints = npt.NDArray[np.int64]

SMOOTH_S = 0.06
"""Deviation of the bell by which the hips' new height is smoothed."""
_FLAT = np.array([1.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Stride:
    """How somebody else goes.

    Attributes:
        length: times as far over the floor.
        out_m: by which each foot is further out.
    """

    length: float
    out_m: float

    @staticmethod
    def drawn(rng: np.random.Generator) -> "Stride":
        """Anybody's."""
        return Stride(length=float(np.exp(rng.uniform(-0.2, 0.2))), out_m=rng.uniform(-0.03, 0.1))


def with_other_strides(
    p: Array, R: Array, pose: Array, contact: Ints, rate_hz: float, how: Stride
) -> tuple[Array, Array]:
    """The same piece of a clip with other strides; as it is where legs could not do it.

    Args:
        p: (frames, 4, 3) the points of the features, world, standard skeleton.
        R: (frames, 4, 3, 3), which stay.
        pose: (frames, 48) the truth.
        contact: (frames, 2).
        rate_hz: of the frames.
        how: see there.

    Returns:
        p and pose alike.
    """
    joints = pose_from_6d(pose)
    ankles = ankles_of(p, R, joints)
    moved = (how.length - 1.0) * (p[:, HIPS] - p[0, HIPS]) * _FLAT
    feet_moved = (how.length - 1.0) * (ankles - p[0, HIPS]) * _FLAT
    new_ankles = ankles + feet_moved + how.out_m * _outwards(R[:, HIPS], contact)
    lower = _lower(p[:, HIPS], moved, R[:, HIPS], ankles, new_ankles, contact, rate_hz)
    new_p = p + moved[:, None]
    new_p[..., 1] -= lower[:, None]
    if not can_reach(apart(new_p, R, new_ankles), apart(p, R, ankles)):
        return p, pose
    R_ref = reference_frames(R[:, HIPS])[:, None]
    return new_p, pose_to_ankles(joints, R_ref, new_p, R, new_ankles)


def _outwards(R_hips: Array, contact: Ints) -> Array:
    """Unit vectors (frames, 2, 3) to the left for the left foot, right for the right one.

    They stay as they are while a foot stands, and turn while it swings.
    """
    yaw = np.unwrap(heading_angle(R_hips)[0])
    out = np.zeros((len(yaw), 2, 3))
    for foot, side in enumerate((1.0, -1.0)):
        angle = _held(yaw, contact[:, foot] > 0)
        out[:, foot, 0], out[:, foot, 2] = side * np.cos(angle), -side * np.sin(angle)
    return out


def _held(yaw: Array, stands: npt.NDArray[np.bool_]) -> Array:
    """The mean over each stance, and evenly from one to the next."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]])))
    if not len(edges):
        return yaw
    at: list[int] = []
    value: list[float] = []
    for first, end in edges.reshape(-1, 2):
        at += [int(first), int(end) - 1]
        value += [float(yaw[first:end].mean())] * 2
    return np.asarray(np.interp(np.arange(len(yaw)), at, value))


def _lower(
    p_hips: Array,
    moved: Array,
    R_hips: Array,
    ankles: Array,
    new_ankles: Array,
    contact: Ints,
    rate_hz: float,
) -> Array:
    """By how much the hips are lowered (frames,), so that standing legs bend as they did."""
    legs = ankles - sockets(p_hips, R_hips)
    new_legs = new_ankles - sockets(p_hips + moved, R_hips)
    length = np.minimum(np.linalg.norm(legs, axis=-1), STRETCHED * LEG_M)
    flat = np.linalg.norm(new_legs * _FLAT, axis=-1)
    high = np.sqrt(np.maximum(length**2 - flat**2, (0.3 * LEG_M) ** 2))
    asked = np.where(contact > 0, -new_legs[..., 1] - high, -np.inf).max(axis=1)
    known = np.flatnonzero(np.isfinite(asked))
    if not len(known):
        return np.zeros(len(asked))
    asked = np.interp(np.arange(len(asked)), known, asked[known])
    lower = gaussian_filter1d(asked, SMOOTH_S * rate_hz, mode="nearest")
    most = np.sqrt(np.maximum((STRETCHED * LEG_M) ** 2 - flat**2, 0.0))
    short = (-new_legs[..., 1] - most).max(axis=1) - lower
    # no less than what is short anywhere near, so that the smoothed one is enough
    near = 2 * round(3.0 * SMOOTH_S * rate_hz) + 1
    more = maximum_filter1d(np.maximum(short, 0.0), near, mode="nearest")
    return np.asarray(lower + gaussian_filter1d(more, SMOOTH_S * rate_hz, truncate=3.0))
