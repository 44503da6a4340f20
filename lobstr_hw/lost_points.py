"""Where a point is that no tracker sees: it goes on with the part of the body next to it.

A lost pelvis goes with the head and turns with head and hands, a lost head or hand goes with the
pelvis. Only what happens from one step to the next is looked at, so there is nothing to remember
but the last poses.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from lobstr_hw.features import POINT_ROLES, Bools, Points
from lobstr_hw.predictors.predictor import Frame
from lobstr_hw.rotations import Array, heading_angle, rotation_y, transpose
from lobstr_hw.trackers import TrackerRole

__all__ = ["follow", "seen_points"]

_PELVIS, _HEAD, _LEFT, _RIGHT = range(4)
_UP = 1


@dataclass(frozen=True, slots=True)
class _Following:
    """Who goes with whom.

    Attributes:
        leader: whose way is gone along with.
        followers: who goes.
        turns: shares of the turns about the vertical of pelvis, head and hands.
        rise: share of the leader's.
        seen: whether the leader has to be seen; else its guess will do.
    """

    leader: int
    followers: tuple[int, ...]
    turns: tuple[float, float, float, float]
    rise: float
    seen: bool


_ORDER = (
    # people look around and bow without their hips: shares chosen on validation (docs/decisions.md)
    _Following(_HEAD, (_PELVIS,), turns=(0.0, 0.45, 0.15, 0.15), rise=0.7, seen=True),
    _Following(_PELVIS, (_HEAD, _LEFT, _RIGHT), turns=(1.0, 0.0, 0.0, 0.0), rise=1.0, seen=False),
)
HIGHEST_HIPS = 1.05
"""Metres on the standard skeleton, which stands at 1.0: hips lost in a bow do not float when the
head comes up again."""


def seen_points(frame: Frame) -> Points:
    """The four points of a frame, in the order of the features; not yet in a reference frame."""
    order = _order(frame.roles)
    R = frame.R.take(order, axis=1)
    return Points(
        frame.p.take(order, axis=1),
        R,
        frame.valid_p.take(order, axis=1),
        frame.valid_R.take(order, axis=1),
        R[:, _PELVIS],
    )


@cache
def _order(roles: tuple[TrackerRole, ...]) -> npt.NDArray[np.int64]:
    """Where the points of the features stand among roles."""
    return np.array([roles.index(role) for role in POINT_ROLES], dtype=np.int64)


def follow(before: Points, now: Points, seen: Bools) -> Points:
    """The points now, those that are lost taken along from a step before.

    A pelvis stays where it is while the head is lost as well. When a leader comes back its
    followers stay: to be seen again is no movement.

    Args:
        before: (n, 4, ...) pelvis, head and hands a step ago; metres on the standard skeleton.
        now: (n, 4, ...); what is not valid is guessed.
        seen: (n, 4) which were seen at some time; the others are left as they are.
    """
    lost_p, lost_R = ~now.valid_p & seen, ~now.valid_R & seen
    if not (lost_p.any() or lost_R.any()):
        return now
    steady = (before.valid_p | ~now.valid_p) & (before.valid_R | ~now.valid_R)  # not back just now
    turning = steady & (now.valid_R | lost_R)  # what was never seen turns nobody
    p = np.where(lost_p[..., None], before.p, now.p)
    R = np.where(lost_R[..., None, None], before.R, now.R)
    for one in _ORDER:
        led = list(one.followers)
        if not (lost_p[:, led].any() or lost_R[:, led].any()):
            continue
        leads = steady[:, one.leader]
        if one.seen:
            leads = leads & ~(lost_p | lost_R)[:, one.leader]
        led_p, led_R = lost_p[:, led] & leads[:, None], lost_R[:, led] & leads[:, None]
        guess_p, guess_R = _led(one, before.p, before.R, p, R, turning)
        p[:, led] = np.where(led_p[..., None], guess_p, p[:, led])
        R[:, led] = np.where(led_R[..., None, None], guess_R, R[:, led])
    return Points(p, R, now.valid_p, now.valid_R, now.R_ref)


def _led(
    one: _Following, p_before: Array, R_before: Array, p: Array, R: Array, turning: Bools
) -> tuple[Array, Array]:
    """Poses (n, followers, ...) of all followers, lost or not."""
    led, leader = list(one.followers), one.leader
    yaws, _ = heading_angle(R @ transpose(R_before))  # (n, 4); of who is lost 0, or the guess's
    turn = rotation_y(np.where(turning, yaws, 0.0) @ np.array(one.turns))[:, None]
    arm = p_before[:, led] - p_before[:, None, leader]
    guess = p[:, None, leader] + (turn @ arm[..., None])[..., 0]
    rise = one.rise * (p[:, None, leader, _UP] - p_before[:, None, leader, _UP])
    height = p_before[:, led, _UP]
    if _PELVIS in led:
        rise = np.minimum(rise, np.maximum(HIGHEST_HIPS - height, 0.0))
    guess[..., _UP] = height + rise
    return guess, turn @ R_before[:, led]
