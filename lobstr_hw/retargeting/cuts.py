"""Known faults taken out of a clip: what is left comes in pieces."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lobstr_hw.retargeting.clips import Fault
from lobstr_hw.rotations import Array, geodesic_angle
from lobstr_hw.skeleton import Joint, global_rotations

__all__ = ["bad_frames", "find_flips", "find_jumps", "good_pieces"]

Bools = npt.NDArray[np.bool_]

_JUMP = np.radians(60.0)
_MARGIN_S = 0.1
_FLIP_S = 1.0
_LEAST_S = 1.0
_HEAD_TO_CHEST = np.radians(110.0)
_CHEST_TO_HIPS = np.radians(100.0)
_BACKWARD = -0.3  # cosine between a flat foot and an upright pelvis


def find_jumps(R_local: Array, rate_hz: float) -> Bools:
    """Frames (F,) to drop: around any joint that turns more than 60 degrees from one to the next.

    Two jumps of one joint within a second are a flip and its end: all between goes too.

    Args:
        R_local: (F, 22, 3, 3) of the standard skeleton, legs solved.
        rate_hz: of the frames.
    """
    bad = np.zeros(len(R_local), dtype=bool)
    if len(R_local) < 2:
        return bad
    jumps = geodesic_angle(R_local[:-1], R_local[1:]) > _JUMP  # (F - 1, joints)
    margin = max(1, round(_MARGIN_S * rate_hz))
    for joint in np.flatnonzero(jumps.any(axis=0)):
        at = np.flatnonzero(jumps[:, joint])
        for a, b in zip(at, [*at[1:], at[-1]], strict=True):
            end = b if b - a < _FLIP_S * rate_hz else a
            bad[max(0, a + 1 - margin) : end + 1 + margin] = True
    return bad


def find_flips(R_local: Array) -> Bools:
    """Frames (F,) in which a joint is turned as no body can: a flip that lasts.

    The head over 110 degrees from the chest, the chest over 100 from the pelvis, or a flat foot
    that points backward under an upright pelvis.
    """
    R = global_rotations(R_local)
    hips, chest = R[:, Joint.HIPS], R[:, Joint.UPPER_CHEST]
    bad = geodesic_angle(R[:, Joint.HEAD], chest) > _HEAD_TO_CHEST
    bad |= geodesic_angle(chest, hips) > _CHEST_TO_HIPS
    for foot in (R[:, Joint.LEFT_FOOT], R[:, Joint.RIGHT_FOOT]):
        upright = (hips[:, 1, 1] > 0.7) & (foot[:, 1, 1] > 0.7)
        bad |= upright & (np.sum(foot[:, :, 2] * hips[:, :, 2], axis=-1) < _BACKWARD)
    return np.asarray(bad)


def bad_frames(R_local: Array, rate_hz: float, faults: Sequence[Fault]) -> Bools:
    """Frames (F,) that ``cut`` faults take out: those named, or those found where none are."""
    bad = np.zeros(len(R_local), dtype=bool)
    for fault in faults:
        for first, last in fault.frames:
            bad[first : None if last is None else last + 1] = True
        if not fault.frames:
            bad |= find_jumps(R_local, rate_hz) | find_flips(R_local)
    return bad


def good_pieces(bad: Bools, rate_hz: float) -> list[tuple[int, int]]:
    """The stretches [first, last) of at least a second without a bad frame."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], bad, [True]]).astype(int)))
    pieces = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(a, b) for a, b in pieces if b - a > _LEAST_S * rate_hz]
