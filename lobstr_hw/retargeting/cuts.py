"""Known faults taken out of a clip: what is left comes in pieces."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lobstr_hw.retargeting.clips import Fault
from lobstr_hw.rotations import Array, geodesic_angle

__all__ = ["find_jumps", "good_pieces"]

_JUMP = np.radians(60.0)
_MARGIN_S = 0.1
_FLIP_S = 1.0
_LEAST_S = 1.0


def find_jumps(R_local: Array, rate_hz: float) -> npt.NDArray[np.bool_]:
    """Frames (F,) to drop: around any joint that turns more than 60 degrees from one to the next.

    Two jumps of one joint within a second are a flip and its end: all between goes too.
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


def good_pieces(R_local: Array, rate_hz: float, faults: Sequence[Fault]) -> list[tuple[int, int]]:
    """The stretches [first, last) of at least a second that no ``cut`` fault touches."""
    bad = np.zeros(len(R_local), dtype=bool)
    for fault in faults:
        for first, last in fault.frames:
            bad[first : None if last is None else last + 1] = True
        if not fault.frames:
            bad |= find_jumps(R_local, rate_hz)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], bad, [True]]).astype(int)))
    pieces = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(a, b) for a, b in pieces if b - a > _LEAST_S * rate_hz]
