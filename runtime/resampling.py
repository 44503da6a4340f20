"""The last 0.3 s of every role, and its pose at any time asked for.

Between two samples positions go linearly and rotations by slerp. Beyond the newest sample they go
on with its last 10 ms' slope for at most 25 ms, then hold.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.poses import Pose
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, slerp

__all__ = ["History", "Resampled"]

KEPT_S = 0.3
SLOPE_S = 0.010
EXTRAPOLATED_S = 0.025
VALID_S = 0.1
"""A role is measured while a sample lies this close to the time asked for; slow trackers (30 Hz)
and a few lost packets must not make validity flicker, for the features start anew each time."""
CAPACITY = 1024
"""Samples per role before the buffer is packed: 0.3 s at 1 kHz and room to spare."""


@dataclass(frozen=True, slots=True, eq=False)
class Resampled:
    """Tracker poses of all roles at some times.

    Attributes:
        p: (times, roles, 3) metres.
        R: (times, roles, 3, 3).
        valid_p: (times, roles) measured near that time; others hold the last good value.
        valid_R: (times, roles).
    """

    p: Array
    R: Array
    valid_p: Bools
    valid_R: Bools


class _Track:
    """Samples of one role in preallocated arrays, oldest first."""

    def __init__(self) -> None:
        self.times = np.empty(CAPACITY)
        self.p = np.zeros((CAPACITY, 3))
        self.R = np.empty((CAPACITY, 3, 3))
        self.has_p = np.zeros(CAPACITY, dtype=np.bool_)
        self.first = 0
        self.end = 0

    def add(self, time_s: float, p: Array | None, R: Array) -> bool:
        if self.end and time_s <= self.times[self.end - 1]:
            return False
        if self.end == CAPACITY:
            self._pack()
        i = self.end
        self.times[i], self.R[i] = time_s, R
        self.has_p[i] = p is not None
        if p is not None:
            self.p[i] = p
        elif i:
            self.p[i] = self.p[i - 1]
        self.end += 1
        while self.times[self.first] < time_s - KEPT_S:
            self.first += 1
        return True

    def _pack(self) -> None:
        self.first = max(self.first, CAPACITY // 2)  # a faster tracker keeps less
        n = self.end - self.first
        for values in (self.times, self.p, self.R, self.has_p):
            values[:n] = values[self.first : self.end]
        self.first, self.end = 0, n

    def shift(self, R: Array, p: Array, before_s: float) -> None:
        old = slice(self.first, int(np.searchsorted(self.times[: self.end], before_s)))
        self.p[old] = self.p[old] @ R.T + p
        self.R[old] = R @ self.R[old]

    def around(self, time_s: float) -> tuple[int, int, float, bool]:
        """Samples a, b and the fraction from a to b that stand for a time; whether measured."""
        newest = self.end - 1
        ahead_s = time_s - float(self.times[newest])
        if ahead_s >= 0.0:
            return (*self._beyond(newest, ahead_s), ahead_s <= VALID_S)
        b = int(np.searchsorted(self.times[self.first : self.end], time_s, "right")) + self.first
        if b == self.first:  # older than anything kept
            return b, b, 0.0, False
        t_a, t_b = float(self.times[b - 1]), float(self.times[b])
        measured = min(time_s - t_a, t_b - time_s) <= VALID_S
        return b - 1, b, (time_s - t_a) / (t_b - t_a), measured

    def _beyond(self, newest: int, ahead_s: float) -> tuple[int, int, float]:
        a = newest - 1
        t = float(self.times[newest])
        while a > self.first and t - self.times[a] < SLOPE_S - 1e-9:
            a -= 1
        if ahead_s == 0.0 or a < self.first or t - self.times[a] > VALID_S:
            return newest, newest, 0.0
        ahead_s = min(ahead_s, EXTRAPOLATED_S)
        return a, newest, 1.0 + ahead_s / (t - float(self.times[a]))


class History:
    """What the roles said lately. Not thread-safe; the loop owns it."""

    def __init__(self, roles: int) -> None:
        """Preallocate room for a number of roles."""
        self._tracks = [_Track() for _ in range(roles)]

    def add(self, role: int, time_s: float, p: Array | None, R: Array) -> bool:
        """Keep a believable sample of the role with this index.

        Returns:
            False when it is not newer than the last one, and thus was left out.
        """
        return self._tracks[role].add(time_s, p, R)

    def seen(self, role: int) -> bool:
        """Whether the role ever had a sample."""
        return self._tracks[role].end > 0

    def newest_s(self, role: int) -> float:
        """Time of the newest sample; minus infinity when there is none."""
        track = self._tracks[role]
        return float(track.times[track.end - 1]) if track.end else -np.inf

    def shift(self, T_new_old: Pose, before_s: float) -> None:
        """The space was set up anew: what was said before a time is said in the new one."""
        for track in self._tracks:
            track.shift(T_new_old.R, T_new_old.p, before_s)

    def at(self, times_s: Sequence[float]) -> Resampled:
        """Poses at some times; a role never seen holds the identity and is not valid."""
        shape = (len(times_s), len(self._tracks))
        p, R = np.zeros((2, *shape, 3)), np.empty((2, *shape, 3, 3))
        R[...] = np.eye(3)
        f = np.zeros(shape)
        valid_p, valid_R = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
        for r, track in enumerate(self._tracks):
            if not track.end:
                continue
            for i, time_s in enumerate(times_s):
                a, b, f[i, r], measured = track.around(time_s)
                p[0, i, r], p[1, i, r] = track.p[a], track.p[b]
                R[0, i, r], R[1, i, r] = track.R[a], track.R[b]
                valid_R[i, r] = measured
                valid_p[i, r] = measured and track.has_p[a] and track.has_p[b]
        between = p[0] + f[..., None] * (p[1] - p[0])
        return Resampled(between, slerp(R[0], R[1], f), valid_p, valid_R)
