"""The four points as they were shown last, for what becomes of those that are lost."""

from dataclasses import dataclass, replace

import numpy as np

from lobstr_hw.features import POINT_ROLES, Points
from lobstr_hw.lost_points import follow, seen_points
from lobstr_hw.predictors.predictor import Bools, Frame
from lobstr_hw.rotations import Array

__all__ = ["LastPoints"]


@dataclass(frozen=True, slots=True, eq=False)
class LastPoints:
    """Pelvis, head and hands of n people at the last tick.

    Attributes:
        p: (n, 4, 3) in the world, metres on the standard skeleton.
        R: (n, 4, 3, 3).
        valid_p, valid_R: (n, 4) which were measured; the others are guesses.
        seen: (n, 4) which were measured at some time.
    """

    p: Array
    R: Array
    valid_p: Bools
    valid_R: Bools
    seen: Bools

    @staticmethod
    def start(n: int) -> "LastPoints":
        """Nothing was seen yet."""
        nothing = np.zeros((n, 4), dtype=np.bool_)
        R = np.broadcast_to(np.eye(3), (n, 4, 3, 3)).copy()
        return LastPoints(np.zeros((n, 4, 3)), R, nothing, nothing, nothing)

    def take_along(self, frame: Frame) -> tuple["LastPoints", Frame]:
        """After a tick, and its frame with guesses for what is lost in it."""
        given = seen_points(frame)
        before = Points(self.p, self.R, self.valid_p, self.valid_R, given.R_ref)
        now = follow(before, given, self.seen)
        seen = self.seen | (now.valid_p & now.valid_R)
        last = LastPoints(now.p, now.R, now.valid_p, now.valid_R, seen)
        return last, frame if now is given else _with_points(frame, now)

    def shifted(self, T: Array) -> "LastPoints":
        """After the play space moved by T (n, 4, 4)."""
        R_T = T[:, None, :3, :3]
        p = (R_T @ self.p[..., None])[..., 0] + T[:, None, :3, 3]
        return replace(self, p=p, R=R_T @ self.R)


def _with_points(frame: Frame, points: Points) -> Frame:
    order = [frame.index(role) for role in POINT_ROLES]
    p, R = frame.p.copy(), frame.R.copy()
    p[:, order], R[:, order] = points.p, points.R
    return replace(frame, p=p, R=R)
