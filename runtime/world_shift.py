"""The play space was set up anew: by how much, as the trackers show it.

A driver says that it happened, not how. All trackers jump together then, by one turn about the
vertical and one shift; a body that jumps so has not moved at all.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from enum import Enum, auto
from itertools import pairwise

import numpy as np

from lobstr_hw.poses import Pose
from lobstr_hw.rotations import geodesic_angle, heading, rotation_mean, transpose
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


_Said = Mapping[TrackerRole, list[tuple[float, Pose]]]
"""What trackers said in one tick: times and poses."""


class ShiftWatch:
    """Shown the samples of every tick; finds the jump that belongs to a recentring."""

    def __init__(self, role_of: Callable[[str], TrackerRole | None]) -> None:
        """Begin with nothing seen.

        Args:
            role_of: the role of a serial; trackers without one do not count.
        """
        self._role_of = role_of
        self._recent: deque[tuple[float, _Said]] = deque()
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
        self._keep(now_s, samples)
        if recentred:
            self._until_s = now_s + WITHIN_S
        if now_s > self._until_s:
            return Shift.NONE
        steps = list(pairwise(said for _, said in self._recent))
        found = [jump for step in steps if (jump := _jump(*step)) is not None]
        if found:
            self._until_s = -np.inf
            return found[-1]
        if self._until_s - now_s > LAST_LOOK_S:
            return Shift.NONE
        self._until_s = -np.inf
        return Shift.APART if any(_jumped(*step) for step in steps) else Shift.NONE

    def _keep(self, now_s: float, samples: Sequence[TrackerSample]) -> None:
        said: dict[TrackerRole, list[tuple[float, Pose]]] = {}
        for sample in samples:
            role, pose = self._role_of(sample.serial), sample.T_world_tracker
            if role is not None and sample.tracked and pose.p is not None:
                said.setdefault(role, []).append((sample.time_s, Pose(pose.R, pose.p)))
        if said:
            self._recent.append((now_s, said))
        while self._recent and self._recent[0][0] < now_s - WITHIN_S:
            self._recent.popleft()


def _jump(before: _Said, after: _Said) -> tuple[Pose, float] | None:
    """The common shift between two ticks, if it is more than a movement, and since when."""
    roles = [role for role in before if role in after]
    old, new = ([said[role][-1][1] for role in roles] for said in (before, after))
    T = common_shift(old, new)
    if T is None or not _jumped(before, after):
        return None
    calm = [i for i, role in enumerate(roles) if role in CALM]
    T = common_shift([old[i] for i in calm], [new[i] for i in calm]) or T
    since_s = min(
        time_s
        for role, pose in zip(roles, old, strict=True)
        for time_s, seen in after[role]
        if _off(seen, T @ pose) < _off(seen, pose)
    )
    return T, since_s


def _jumped(before: _Said, after: _Said) -> bool:
    """Any tracker did."""
    return any(
        _off(before[role][-1][1], after[role][-1][1]) > 1.0 for role in before if role in after
    )


def _off(a: Pose, b: Pose) -> float:
    """How far apart, 1 being noticeable."""
    apart_m, apart_rad = np.linalg.norm(a.p - b.p), geodesic_angle(a.R, b.R)
    return max(float(apart_m) / NOTICEABLE_M, float(apart_rad) / NOTICEABLE_RAD)
