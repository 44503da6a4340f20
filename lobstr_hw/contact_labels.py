"""When is a foot on the floor? Labels for training and scores, never an input.

The toe base is in contact when it is lower than 3 cm above the local floor (the lower of both feet
over +-2 s) and slower than 25 cm/s; segments shorter than 0.1 s are taken out. The paper's own
label (lower than 1 cm above the clip's floor) stands beside it.
"""

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import TOE_BASE_HEIGHT

__all__ = [
    "HEIGHT_M",
    "SPEED_M_S",
    "contact_labels",
    "debounced",
    "local_floor",
    "paper_contact_labels",
]

Bools = npt.NDArray[np.bool_]

HEIGHT_M = 0.03
SPEED_M_S = 0.25
FLOOR_WINDOW_S = 2.0
SHORTEST_S = 0.1
PAPER_HEIGHT_M = 0.01


def contact_labels(
    p_toes: Array, rate_hz: float, height_m: float = HEIGHT_M, speed_m_s: float = SPEED_M_S
) -> Bools:
    """Contacts (frames, 2) of the toe bases (frames, 2, 3), metres on the standard skeleton."""
    low = p_toes[..., 1] - local_floor(p_toes[..., 1], rate_hz)[:, None] < height_m
    slow = _speed(p_toes, rate_hz) < speed_m_s
    return debounced(low & slow, round(SHORTEST_S * rate_hz + 0.5))


def paper_contact_labels(p_toes: Array) -> Bools:
    """The paper's label: the toe base less than 1 cm above its height in flat stance."""
    return np.asarray(p_toes[..., 1] - TOE_BASE_HEIGHT < PAPER_HEIGHT_M)


def local_floor(heights: Array, rate_hz: float) -> Array:
    """The lowest of both toes (frames,) over +-2 s, cut at the clip's ends; heights (frames, 2)."""
    reach = round(FLOOR_WINDOW_S * rate_hz)
    lower = np.pad(heights.min(axis=1), reach, constant_values=np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(lower, 2 * reach + 1)
    return np.asarray(windows.min(axis=1))


def _speed(p: Array, rate_hz: float) -> Array:
    if len(p) < 2:
        return np.zeros(p.shape[:-1])
    return np.asarray(np.linalg.norm(np.gradient(p, axis=0), axis=-1) * rate_hz)


def debounced(labels: Bools, shortest: int) -> Bools:
    """Labels (frames, feet) without runs shorter than ``shortest`` frames.

    Short gaps are closed first, then short contacts are dropped; a run that touches an end of the
    clip stays, for its true length is not known.
    """
    out = labels.copy()
    for foot in out.T:
        _flip_short_runs(foot, False, shortest)
        _flip_short_runs(foot, True, shortest)
    return out


def _flip_short_runs(labels: Bools, value: bool, shortest: int) -> None:
    edges = np.flatnonzero(np.diff(labels)) + 1
    for start, end in pairwise(edges):
        if labels[start] == value and end - start < shortest:
            labels[start:end] = not value
