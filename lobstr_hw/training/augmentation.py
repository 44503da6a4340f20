"""Errors of made trackers, so that the network has seen worse than clean captures.

The paper adds Gaussian offsets of 0.01 m and turns of up to 1.5 degrees and calls them the drift of
Lighthouse tracking. White in every frame, 1 cm is a false speed of half a metre per second; the
same magnitudes as slowly varying drift are the default here (docs/decisions.md).
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from lobstr_hw.rotations import Array, from_rotation_vector

__all__ = ["Augmentation", "add_tracker_errors"]


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How large the errors are and how fast they change.

    Attributes:
        kind: ``drift`` (Ornstein-Uhlenbeck), ``white`` (a new error each frame, the paper's), or
            ``none``.
        position_m: standard deviation of the signed length of the offset.
        rotation_max_deg: the turn is at most this.
        drift_time_s: after which an error has mostly been forgotten.
    """

    kind: Literal["drift", "white", "none"] = "drift"
    position_m: float = 0.01
    rotation_max_deg: float = 1.5
    drift_time_s: float = 4.0


def add_tracker_errors(
    p: Array, R: Array, rate_hz: float, augmentation: Augmentation, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Disturb windows of points, frames first: p (frames, ..., 3), R (frames, ..., 3, 3)."""
    if augmentation.kind == "none":
        return p, R
    decay = 0.0
    if augmentation.kind == "drift":
        decay = float(np.exp(-1.0 / (augmentation.drift_time_s * rate_hz)))
    # a length of N(0, sigma) in a random direction has sigma / sqrt(3) along each axis
    offset = _drift(p.shape, decay, rng) * (augmentation.position_m / np.sqrt(3.0))
    turn = _bounded(_drift(p.shape, decay, rng), np.deg2rad(augmentation.rotation_max_deg))
    return p + offset, from_rotation_vector(turn) @ R


def _drift(shape: tuple[int, ...], decay: float, rng: np.random.Generator) -> Array:
    """A stationary first-order process of variance 1 along the first axis; decay 0 is white."""
    out = rng.standard_normal(shape)
    fresh = np.sqrt(1.0 - decay**2)
    for before, now in pairwise(out):
        now *= fresh
        now += decay * before
    return out


def _bounded(vectors: Array, limit: float) -> Array:
    """Rotation vectors whose length never passes ``limit`` and is about half of it on average."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors * (limit * np.tanh(length / 3.0) / np.maximum(length, 1e-9)))
