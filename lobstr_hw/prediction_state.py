"""The last two predictions, and what of them a tick shows."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.ik.vectors import log_rotation, turn
from lobstr_hw.predictors.predictor import Bools, Prediction
from lobstr_hw.rotations import Array

__all__ = ["LastTwo"]


@dataclass(frozen=True, slots=True, eq=False)
class LastTwo:
    """Predictions j - 1 and j of n people.

    Attributes:
        R: (n, 2, joints given, 3, 3), older first.
        contact: (n, 2) probability at j.
        time_s: (n,) of j, on the predictor's grid.
        known: (n,) whether there has been a prediction at all.
    """

    R: Array
    contact: Array
    time_s: Array
    known: Bools

    @staticmethod
    def start(n: int, joints: int) -> "LastTwo":
        """Before the first prediction: straight legs."""
        R = np.broadcast_to(np.eye(3), (n, 2, joints, 3, 3)).copy()
        return LastTwo(R, np.zeros((n, 2)), np.zeros(n), np.zeros(n, dtype=np.bool_))

    def add(self, prediction: Prediction, time_s: float) -> "LastTwo":
        """After a grid step at ``time_s``; the first one stands for the one before it too."""
        known = self.known[:, None, None, None]
        older = np.where(known, self.R[:, 1], prediction.R)
        return LastTwo(
            R=np.stack([older, prediction.R], axis=1),
            contact=np.asarray(prediction.contact, dtype=np.float64),
            time_s=np.full_like(self.time_s, time_s),
            known=np.ones_like(self.known),
        )

    def newest(self) -> Array:
        """Output j: (n, joints, 3, 3)."""
        return self.R[:, 1]

    def between(self, fraction: Array) -> Array:
        """From output j - 1 to j, joint by joint, at a share (n,) of the step, or beyond."""
        w = log_rotation(np.swapaxes(self.R[:, 0], -1, -2) @ self.R[:, 1])
        return np.asarray(self.R[:, 0] @ turn(fraction[:, None, None] * w))
