"""The play space was set up anew: by how much, as the trackers show it.

A driver says that it happened, not how. All trackers jump together then, by one turn about the
vertical and one shift; a body that jumps so has not moved at all.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, geodesic_angle, heading, rotation_mean, transpose
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["Shift", "ShiftWatch", "common_shift"]

AGREE_M, AGREE_RAD = 0.15, float(np.deg2rad(15.0))
"""So far a body moves between two samples; trackers that differ by more have not jumped as one."""
NOTICEABLE_M, NOTICEABLE_RAD = 0.10, float(np.deg2rad(6.0))
"""What is less passes as a movement, and leaves no trace worth the name."""
WITHIN_S = 0.4
"""The jump comes at most so long before or after the word of it."""
CALM = (TrackerRole.HEAD, TrackerRole.PELVIS)
"""These move least between two samples, so they say best by how much."""
LAST_LOOK_S = 0.05
WAIT_S = 0.15
"""So long a tracker that is out of sight is waited for; the gate believes in a new place soon
after. Without it those in sight decide."""
SKEW_S = 0.05
"""Trackers of one system may begin with the new space so far apart."""
USUAL_GAP_S = 0.05
"""Between two samples; who was out of sight for longer may have moved that much farther."""
LEAST_TRACKERS = 2


class Shift(Enum):
    """What became of a recentring."""

    NONE = auto()
    APART = auto()


def common_shift(before: Sequence[Pose], after: Sequence[Pose]) -> Pose | None:
    """The one turn about Y and shift that takes all trackers from before to after.

    Args:
        before: poses in the old space.
        after: of the same trackers a moment later, in the new one.

    Returns:
        From the old space to the new one; None where they are too few, or disagree.
    """
    if len(before) < LEAST_TRACKERS:
        return None
    p_old, p_new = (np.array([pose.p for pose in poses]) for poses in (before, after))
    R_old, R_new = (np.array([pose.R for pose in poses]) for poses in (before, after))
    turns = R_new @ transpose(R_old)
    R = heading(rotation_mean(turns))
    shifts = p_new - p_old @ R.T
    p = np.median(shifts, axis=0)
    off_m, off_rad = np.linalg.norm(shifts - p, axis=-1), geodesic_angle(turns, R)
    if np.max(off_m) > AGREE_M or np.max(off_rad) > AGREE_RAD:
        return None
    return Pose(R, p)


@dataclass(frozen=True, slots=True, eq=False)
class _Track:
    """What one tracker said lately, oldest first.

    Attributes:
        heard_s, time_s: (n,): when each pose came, and its own time.
        p, R: (n, 3) and (n, 3, 3).
        leaps: indices of poses that are noticeably farther from the one before than a movement
            explains: a quick hand goes as far in the steps beside.
    """

    heard_s: Array
    time_s: Array
    p: Array
    R: Array
    leaps: NDArray[np.intp]

    def pose(self, i: int) -> Pose:
        """One of them."""
        return Pose(self.R[i], self.p[i])

    def first_after(self, at_s: float) -> int | None:
        """The first pose in the new space, if everything was moved at a time.

        None where there is none yet; 0 where there is none of the old space.
        """
        near = self.leaps[np.abs(self.time_s[self.leaps] - at_s) <= SKEW_S]
        if len(near):
            return int(near[np.argmin(np.abs(self.time_s[near] - at_s))])
        i = int(np.searchsorted(self.time_s, at_s))
        return i if i < len(self.time_s) else None


class ShiftWatch:
    """Shown the samples of every tick; finds the jump that belongs to a recentring."""

    def __init__(self, role_of: Callable[[str], TrackerRole | None]) -> None:
        """Begin with nothing seen.

        Args:
            role_of: the role of a serial; trackers without one do not count.
        """
        self._role_of = role_of
        self._seen: dict[TrackerRole, deque[tuple[float, float, Pose]]] = {}
        self._until_s = -np.inf

    def add(
        self, now_s: float, samples: Sequence[TrackerSample], recentred: bool
    ) -> tuple[Pose, float] | Shift:
        """Look at a tick.

        Args:
            now_s: its time.
            samples: believed or not.
            recentred: a driver says that it has happened.

        Returns:
            From the old space to the new one, and the time of the first sample in the new one;
            APART where trackers jumped, but not all as one.
        """
        if recentred:
            self._until_s = now_s + WITHIN_S
        self._keep(now_s, samples)
        if now_s > self._until_s:
            return Shift.NONE
        tracks = {role: _track(seen) for role, seen in self._seen.items()}
        leaps = [
            (float(t.heard_s[i]), float(t.time_s[i])) for t in tracks.values() for i in t.leaps
        ]
        for heard_s, at_s in sorted(set(leaps), reverse=True):
            found = _jump(tracks, at_s, wait=now_s - heard_s < WAIT_S)
            if found is not None:
                self._forget(found[1])
                return found
        if self._until_s - now_s > LAST_LOOK_S:
            return Shift.NONE
        self._until_s = -np.inf
        return Shift.APART if leaps else Shift.NONE

    def _keep(self, now_s: float, samples: Sequence[TrackerSample]) -> None:
        for sample in samples:
            role, pose = self._role_of(sample.serial), sample.T_world_tracker
            if role is not None and sample.tracked and pose.p is not None:
                seen = self._seen.setdefault(role, deque())
                if not seen or seen[-1][1] < sample.time_s:
                    seen.append((now_s, sample.time_s, Pose(pose.R, pose.p)))
        # nothing of a search is dropped before it ends
        word_s = min(now_s, self._until_s - WITHIN_S) if now_s <= self._until_s else now_s
        for role, seen in list(self._seen.items()):
            while seen and seen[0][0] < word_s - WITHIN_S:
                seen.popleft()
            if not seen:
                del self._seen[role]

    def _forget(self, before_s: float) -> None:
        """The old space is done with, also if the word of it comes twice."""
        self._until_s = -np.inf
        for seen in self._seen.values():
            while seen and seen[0][1] < before_s:
                seen.popleft()


def _track(seen: Sequence[tuple[float, float, Pose]]) -> _Track:
    heard_s, time_s = (np.array([one[k] for one in seen]) for k in (0, 1))
    p, R = np.array([one[2].p for one in seen]), np.array([one[2].R for one in seen])
    step = np.maximum(
        np.linalg.norm(np.diff(p, axis=0), axis=-1) / NOTICEABLE_M,
        geodesic_angle(R[:-1], R[1:]) / NOTICEABLE_RAD,
    )
    beside = np.zeros(len(step) + 2)
    beside[1:-1] = step
    leaps = 1 + np.flatnonzero(step > 1.0 + np.maximum(beside[:-2], beside[2:]))
    return _Track(heard_s, time_s, p, R, leaps)


def _jump(
    tracks: Mapping[TrackerRole, _Track], at_s: float, *, wait: bool
) -> tuple[Pose, float] | None:
    """The common shift at a time, if it is more than a movement, and since when.

    Args:
        tracks: of every tracker seen lately.
        at_s: a tracker leapt then.
        wait: for those that have said nothing since.
    """
    first = {role: track.first_after(at_s) for role, track in tracks.items()}
    if wait and None in first.values():
        return None
    pairs = {role: (tracks[role], i) for role, i in first.items() if i}
    since_s = min((float(track.time_s[i]) for track, i in pairs.values()), default=at_s)
    gap_s = {
        role: float(track.time_s[i] - track.time_s[i - 1]) for role, (track, i) in pairs.items()
    }
    old = {role: track.pose(i - 1) for role, (track, i) in pairs.items()}
    new = {role: track.pose(i) for role, (track, i) in pairs.items()}
    steady = [role for role in pairs if gap_s[role] <= USUAL_GAP_S]
    steady = steady if len(steady) >= LEAST_TRACKERS else list(pairs)
    T = common_shift([old[role] for role in steady], [new[role] for role in steady])
    if T is None:
        return None
    for role in pairs:
        if _off(T @ old[role], new[role], AGREE_M, AGREE_RAD) > max(1.0, gap_s[role] / USUAL_GAP_S):
            return None
    calm = [role for role in steady if role in CALM]
    if len(calm) >= LEAST_TRACKERS:
        T = common_shift([old[role] for role in calm], [new[role] for role in calm]) or T
    if not all(_off(T @ old[role], old[role]) > 1.0 for role in calm or steady):
        return None
    return T, since_s


def _off(a: Pose, b: Pose, unit_m: float = NOTICEABLE_M, unit_rad: float = NOTICEABLE_RAD) -> float:
    """How far apart, 1 being noticeable."""
    apart_m, apart_rad = np.linalg.norm(a.p - b.p), geodesic_angle(a.R, b.R)
    return max(float(apart_m) / unit_m, float(apart_rad) / unit_rad)
