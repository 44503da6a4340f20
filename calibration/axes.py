"""The axis about which a joint turned: the main direction of its angular velocity."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array

__all__ = ["Axis", "main_axis"]

_CONE = np.cos(np.deg2rad(32.0))
_ROUNDS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """An axis of turning.

    Attributes:
        seen: (3,) in the frame of the angular velocities, unit.
        turned_rad: by how much it turned about it, back and forth.
        wobble_rad: how far the momentary axis strays from it.
    """

    seen: Array
    turned_rad: float
    wobble_rad: float


def main_axis(omega: Array, chosen: Bools, expected: Array, rate_hz: float) -> Axis | None:
    """The axis near ``expected`` about which most of the turning went; None where there was none.

    Args:
        omega: (m, 3) radians per second.
        chosen: (m) frames to look at.
        expected: (3,) where it should be.
        rate_hz: of the frames.
    """
    fast = np.linalg.norm(omega, axis=-1)
    axis = expected
    for _ in range(_ROUNDS):
        along = omega @ axis
        near = chosen & (np.abs(along) > _CONE * fast)
        if not near.any():
            return None
        w, V = np.linalg.eigh(omega[near].T @ omega[near])
        axis = V[:, -1] * np.sign(V[:, -1] @ expected)
    wobble = float(np.sqrt(max(w[0] + w[1], 0.0) / 2.0 / max(w[2], 1e-12)))
    return Axis(axis, float(np.sum(np.abs(omega[near] @ axis)) / rate_hz), wobble)
