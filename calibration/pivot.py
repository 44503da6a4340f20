"""The point of a tracker that stays where it is while the tracker turns: a lever arm.

If a joint at l (in the tracker's frame) rests, or drifts slowly, then ``p + R l = c + d t`` within
a short window, a linear equation for l. Windows in which the joint did move fit badly and count
little (Student's t).
"""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.poses import frozen
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array

__all__ = ["Pivot", "fit_pivot", "windows_of"]

_ROUNDS = 10
_FREEDOM = 3.0  # of Student's t: one window in ten may be far off
_INDEPENDENT = 3.0  # samples of a window that tell something new; people do not jitter


@dataclass(frozen=True, slots=True, eq=False)
class Pivot:
    """A lever.

    Attributes:
        p: (3,) in the tracker's frame, metres.
        covariance: (3, 3) of it.
        windows: how many counted.
        rest_m: by how much the joint moved in these.
    """

    p: Array
    covariance: Array
    windows: int
    rest_m: float

    def __post_init__(self) -> None:
        """Check the shapes once."""
        object.__setattr__(self, "p", frozen(self.p, (3,)))
        object.__setattr__(self, "covariance", frozen(self.covariance, (3, 3)))


def windows_of(chosen: Bools, length: int) -> list[slice]:
    """Windows of ``length`` frames that lie in the frames chosen (m), side by side."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    found = []
    for start, end in edges.reshape(-1, 2):
        count = (end - start) // length
        first = start + (end - start - count * length) // 2
        found += [slice(first + k * length, first + (k + 1) * length) for k in range(count)]
    return found


def fit_pivot(
    p: Array,
    R: Array,
    windows: list[slice],
    prior: Array,
    prior_covariance: Array,
    *,
    noise_m: float,
    rows: Array | None = None,
    order: int = 1,
) -> Pivot:
    """Fit.

    Args:
        p: (m, 3) of the tracker.
        R: (m, 3, 3) of the tracker.
        windows: of frames in which the pivot may have rested.
        prior: (3,) where it is thought to be.
        prior_covariance: (3, 3) of that.
        noise_m: how much a resting pivot moves, beyond a polynomial in time.
        rows: (k, 3) directions in the world along which it rests; all where None.
        order: of that polynomial.
    """
    A, b, size = _equations(p, R, windows, np.eye(3) if rows is None else rows, order)
    information = np.linalg.inv(prior_covariance)
    weight = np.ones(len(A))
    lever = prior
    for _ in range(_ROUNDS):
        w = weight * _INDEPENDENT / (size * noise_m**2)
        H = information + np.einsum("w,wni,wnj->ij", w, A, A)
        g = information @ prior + np.einsum("w,wni,wn->i", w, A, b)
        lever = np.linalg.solve(H, g)
        off = np.sum((b - A @ lever) ** 2, axis=1) * _INDEPENDENT / (size * noise_m**2)
        weight = (_FREEDOM + _INDEPENDENT) / (_FREEDOM + off)
    weight = np.minimum(weight, 1.0)
    rest = np.sqrt(np.sum(weight * off) / max(np.sum(weight) * _INDEPENDENT, 1e-9)) * noise_m
    return Pivot(lever, np.linalg.inv(H), int(np.sum(weight > 0.5)), float(rest))


def _equations(
    p: Array, R: Array, windows: list[slice], rows: Array, order: int
) -> tuple[Array, Array, Array]:
    """A l = b for each window: A (w, n, 3), b (w, n) padded with zeros, and frames (w) of each."""
    length = max((w.stop - w.start for w in windows), default=0)
    A = np.zeros((len(windows), length * len(rows), 3))
    b = np.zeros((len(windows), length * len(rows)))
    for i, window in enumerate(windows):
        n = window.stop - window.start
        t = np.linspace(-1.0, 1.0, n)
        basis = np.linalg.qr(np.stack([t**k for k in range(order + 1)], axis=-1))[0]
        turned = (rows @ R[window]).reshape(n, -1)  # (n, k * 3)
        placed = p[window] @ rows.T  # (n, k)
        turned = turned - basis @ (basis.T @ turned)
        placed = placed - basis @ (basis.T @ placed)
        A[i, : n * len(rows)] = turned.reshape(-1, 3)
        b[i, : n * len(rows)] = -placed.reshape(-1)
    return A, b, np.array([w.stop - w.start for w in windows], dtype=np.float64)
