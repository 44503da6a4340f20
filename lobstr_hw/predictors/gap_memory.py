"""The points of the last two seconds of each person, in arrays of a fixed size.

A ring of :data:`FRAMES` slots, cut into pieces that are arrays of their own: who writes one slot
copies one piece, and a step that writes nothing copies nothing.
"""

import numpy as np
import numpy.typing as npt

from lobstr_hw.features import Points
from lobstr_hw.predictors.predictor import State
from lobstr_hw.rotations import Array, heading

__all__ = ["FRAMES", "NAMES", "Ints", "empty", "read", "shifted", "written"]

FRAMES = 90
PIECE = 15
NAMES = tuple(f"gap.{k}" for k in range(FRAMES // PIECE))
_SHAPES: dict[str, tuple[int, ...]] = {
    "p": (4, 3),
    "R": (4, 3, 3),
    "valid_p": (4,),
    "valid_R": (4,),
    "R_ref": (3, 3),
}
_SIZES = [int(np.prod(shape)) for shape in _SHAPES.values()]
Ints = npt.NDArray[np.int64]


def empty(n: int) -> State:
    """Room for n people."""
    return {name: np.zeros((n, PIECE, sum(_SIZES))) for name in NAMES}


def written(memory: State, who: Ints, slot: Ints, points: Points) -> State:
    """The memory after some slots were written.

    Args:
        memory: as it was; it is left as it is.
        who: (m,) people.
        slot: (m,) theirs; no pair twice.
        points: (m, 4, ...).
    """
    rows, out = _packed(points), {name: memory[name] for name in NAMES}
    for k in np.unique(slot // PIECE):
        here = slot // PIECE == k
        piece = memory[NAMES[k]].copy()
        piece[who[here], slot[here] % PIECE] = rows[here]
        out[NAMES[k]] = piece
    return out


def read(memory: State, who: Ints, slot: Ints) -> Points:
    """Points (frames, m, 4, ...) of slots (frames, m) of people who (m,)."""
    rings = np.concatenate([memory[name][who] for name in NAMES], axis=1)  # (m, FRAMES, 65)
    return _unpacked(rings[np.arange(len(who)), slot])


def shifted(memory: State, T: Array) -> State:
    """The memory after the play space moved by T (n, 4, 4)."""
    R_T, p_T = T[:, None, None, :3, :3], T[:, None, None, :3, 3]
    out = {}
    for name in NAMES:
        points = _unpacked(memory[name])
        p = (R_T @ points.p[..., None])[..., 0] + p_T
        R_ref = heading(T[:, None, :3, :3]) @ points.R_ref
        out[name] = _packed(Points(p, R_T @ points.R, points.valid_p, points.valid_R, R_ref))
    return out


def _packed(points: Points) -> Array:
    """Points (..., 4, ...) as rows of numbers (..., 65)."""
    lead = points.R_ref.shape[:-2]
    parts = [
        getattr(points, name).reshape(*lead, size)
        for name, size in zip(_SHAPES, _SIZES, strict=True)
    ]
    return np.concatenate(parts, axis=-1, dtype=np.float64)


def _unpacked(rows: Array) -> Points:
    parts = np.split(rows, np.cumsum(_SIZES)[:-1], axis=-1)
    p, R, valid_p, valid_R, R_ref = (
        part.reshape(*rows.shape[:-1], *shape)
        for part, shape in zip(parts, _SHAPES.values(), strict=True)
    )
    return Points(p, R, valid_p > 0.5, valid_R > 0.5, R_ref)
