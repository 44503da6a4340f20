"""Is this pose believable? What is not never reaches the history; the role holds its last pose.

Limits are generous: they stop what no body can do, not what is merely odd.
"""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["Gate", "Verdict"]

SPEED_LIMIT_M_S = {
    TrackerRole.HEAD: 8.0,
    TrackerRole.PELVIS: 8.0,
    TrackerRole.CHEST: 8.0,
}
HAND_SPEED_LIMIT_M_S = 20.0
"""A fast pitch leaves the hand at some 40 m/s, a punch at 10; feet kick at 20."""
TURN_LIMIT_RAD_S = 45.0
"""The wrist's twist peaks near 40 rad/s in a racket serve."""
STEP_ALLOWED_M = 0.05
TURN_ALLOWED_RAD = 0.35
"""Beyond what the speed allows: jitter, and lever arms on a quick twist."""

REACH_M = {TrackerRole.PELVIS: 1.3}
"""From the headset; a person of 1.95 m has 0.75 m between the two, and mounts add up to 0.3."""

PLAY_SPACE_M = 1000.0
"""Nobody plays farther from the origin than this."""

SETTLE_S = 0.2
"""A new place is believed after the tracker has stayed consistent there for so long."""
FRESH_S = 0.3
"""Only a head pose this young says what is in reach of it."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a sample may be used, and if not, why (a short name, counted as a gate event)."""

    believed: bool
    reason: str = ""


_GOOD = Verdict(True)


@dataclass(slots=True)
class _Seen:
    """A pose that was taken for true (or is being watched); its position may be older."""

    time_s: float
    p: list[float] | None
    p_time_s: float
    R: Array

    def after(self, before: "_Seen | None") -> "_Seen":
        """This pose, with the place known before where it has none of its own."""
        if self.p is None and before is not None:
            return _Seen(self.time_s, before.p, before.p_time_s, self.R)
        return self

    def could_become(self, other: "_Seen", speed_limit_m_s: float) -> str:
        """Why a body part cannot get from here to there; empty if it can."""
        if self.p is not None and other.p is not None:
            way = speed_limit_m_s * (other.time_s - self.p_time_s)
            if math.dist(self.p, other.p) > STEP_ALLOWED_M + way:
                return "jump"
        turn = TURN_ALLOWED_RAD + TURN_LIMIT_RAD_S * (other.time_s - self.time_s)
        # trace(A^T B) = 1 + 2 cos(angle)
        if turn < math.pi and np.vdot(self.R, other.R) < 1.0 + 2.0 * math.cos(turn):
            return "spin"
        return ""


class Gate:
    """Judges samples role by role.

    Attributes:
        events: how often each reason occurred; a run of bad samples of one role counts once.
    """

    def __init__(self) -> None:
        """Nothing seen yet."""
        self.events: Counter[str] = Counter()
        self._good: dict[TrackerRole, _Seen] = {}
        self._new_place: dict[TrackerRole, tuple[float, _Seen]] = {}
        self._last_reason: dict[TrackerRole, str] = {}

    def judge(self, role: TrackerRole, sample: TrackerSample) -> Verdict:
        """Decide on the next sample of a role; samples come oldest first."""
        reason = self._fault(role, sample)
        if reason and self._last_reason.get(role, "") != reason:
            self.events[reason] += 1
        self._last_reason[role] = reason
        return Verdict(False, reason) if reason else _GOOD

    def shift(self, T_new_old: Pose, before_s: float) -> None:
        """The space was set up anew: what was believed before a time stays believed in it."""
        for role, seen in self._good.items():
            if seen.time_s < before_s:
                p = None if seen.p is None else T_new_old.apply(np.array(seen.p)).tolist()
                self._good[role] = _Seen(seen.time_s, p, seen.p_time_s, T_new_old.R @ seen.R)
        self._new_place.clear()

    def _fault(self, role: TrackerRole, sample: TrackerSample) -> str:
        if not sample.tracked:
            self._new_place.pop(role, None)
            return "untracked"
        p, R = sample.T_world_tracker.p, sample.T_world_tracker.R
        fault = _malformed(p, R) if math.isfinite(sample.time_s) else "nonfinite"
        if fault:
            return fault
        seen = _Seen(sample.time_s, None if p is None else p.tolist(), sample.time_s, R)
        return self._out_of_reach(role, seen) or self._implausible(role, seen)

    def _out_of_reach(self, role: TrackerRole, seen: _Seen) -> str:
        head = self._good.get(TrackerRole.HEAD)
        reach = REACH_M.get(role)
        if reach is None or head is None or head.p is None or seen.p is None:
            return ""
        if seen.time_s - head.time_s > FRESH_S or math.dist(head.p, seen.p) <= reach:
            return ""
        return "out_of_reach"

    def _implausible(self, role: TrackerRole, seen: _Seen) -> str:
        limit = SPEED_LIMIT_M_S.get(role, HAND_SPEED_LIMIT_M_S)
        good = self._good.get(role)
        fault = good.could_become(seen, limit) if good else ""
        if fault and not self._settled(role, seen, limit):
            return fault
        self._new_place.pop(role, None)
        self._good[role] = seen.after(good)
        return ""

    def _settled(self, role: TrackerRole, seen: _Seen, limit: float) -> bool:
        """Whether the tracker has been consistent in its new place for long enough."""
        since_s, before = self._new_place.get(role, (seen.time_s, seen))
        if before.could_become(seen, limit):
            since_s = seen.time_s
        self._new_place[role] = (since_s, seen.after(before))
        return seen.time_s - since_s >= SETTLE_S


def _malformed(p: Array | None, R: Array) -> str:
    """What is wrong with the numbers themselves."""
    rows: list[list[float]] = R.tolist()
    total = sum(map(sum, rows)) + (0.0 if p is None else float(p[0] + p[1] + p[2]))
    if not math.isfinite(total):
        return "nonfinite"
    if p is not None and max(map(abs, p.tolist())) > PLAY_SPACE_M:
        return "too_far"
    if p is not None and not p.any() and rows == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]:
        return "zero_pose"  # what a lost device says
    return "" if _is_rotation(*rows) else "not_a_rotation"


def _is_rotation(x: list[float], y: list[float], z: list[float]) -> bool:
    cross = (
        x[1] * y[2] - x[2] * y[1],
        x[2] * y[0] - x[0] * y[2],
        x[0] * y[1] - x[1] * y[0],
    )
    square = sum(v * v for v in x), sum(v * v for v in y)
    right = abs(sum(a * b for a, b in zip(x, y, strict=True))) < 1e-3
    return right and all(abs(s - 1.0) < 1e-3 for s in square) and math.dist(cross, z) < 1e-3
