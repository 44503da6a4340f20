"""Feet that follow a body: one step after the other, so that a foot on the floor stands still."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.rotations import Array, rotation_x, rotation_y
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

__all__ = ["Feet", "Stepping", "minimum_jerk", "walked"]

_LEG = (Joint.LEFT_UPPER_LEG, Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT)
_BESIDE = float(STANDARD_OFFSETS[Joint.LEFT_UPPER_LEG, 0])
_ANKLE = 1.0 + float(sum(STANDARD_OFFSETS[joint, 1] for joint in _LEG))
_FOOT = 0.13  # from ankle to the ball, on which a heel rises
_SWING = 0.85  # the share of a step's time in which its foot is in the air
_LIFT_M = 0.07


@dataclass(frozen=True, slots=True)
class Stepping:
    """A time in which the body goes somewhere.

    Attributes:
        start_s, end_s: of it.
        steps: how many, evenly spread; the last two bring both feet under the body.
        first: 0 to begin with the left foot, 1 with the right.
    """

    start_s: float
    end_s: float
    steps: int
    first: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Feet:
    """Both feet in time.

    Attributes:
        p: (m, 2, 3) ankles.
        R: (m, 2, 3, 3) feet.
        swinging: (m, 2) from 0 on the floor to 1 in the middle of a swing.
    """

    p: Array
    R: Array
    swinging: Array


def minimum_jerk(t: Array) -> Array:
    """From 0 to 1 as people move, for t (...) from 0 to 1."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t**3 * (10.0 - 15.0 * t + 6.0 * t**2))


def walked(
    times_s: Array, place: Array, yaw: Array, parts: list[Stepping], turned_out: Array
) -> Feet:
    """The feet of someone who moves along ``place``.

    Args:
        times_s: (m,) seconds.
        place: (m, 2) of the hips on the floor: x, z.
        yaw: (m,) heading of the body, without jumps.
        parts: times in which feet may leave the floor, in order.
        turned_out: (2,) yaw of each foot against the body, left first.
    """
    feet = [_one_foot(times_s, place, yaw, parts, side, turned_out) for side in (0, 1)]
    p, R, swinging = (np.stack(values, axis=1) for values in zip(*feet, strict=True))
    return Feet(p, R, swinging)


def _one_foot(
    times_s: Array,
    place: Array,
    yaw: Array,
    parts: list[Stepping],
    side: int,
    turned_out: Array,
) -> tuple[Array, Array, Array]:
    m = len(times_s)
    level, turned = np.empty((m, 2)), np.empty(m)
    lifted, swinging = np.zeros(m), np.zeros(m)
    at, angle = _under(place[0], yaw[0], side), yaw[0] + turned_out[side]
    level[:], turned[:] = at, angle
    for start, end, land in _swings(parts, side):
        goal_place, goal_yaw = _body_at(times_s, place, yaw, land)
        goal, goal_angle = _under(goal_place, goal_yaw, side), goal_yaw + turned_out[side]
        t = (times_s - start) / (end - start)
        w = minimum_jerk(t)
        level = np.where((times_s >= start)[:, None], at + w[:, None] * (goal - at), level)
        turned = np.where(times_s >= start, angle + w * (goal_angle - angle), turned)
        air = np.sin(np.pi * np.clip(t, 0.0, 1.0)) ** 2
        lifted += _LIFT_M * air * min(1.0, 0.3 + float(np.linalg.norm(goal - at)) / 0.4)
        swinging = np.maximum(swinging, air)
        at, angle = goal, goal_angle
    heel = _heel_rise(place - level, turned) * (1.0 - swinging)
    p = np.stack([level[:, 0], _ANKLE + lifted + heel, level[:, 1]], axis=-1)
    return p, rotation_y(turned) @ rotation_x(np.arcsin(heel / _FOOT)), swinging


def _swings(parts: list[Stepping], side: int) -> list[tuple[float, float, float]]:
    """Start and end of each swing of one foot, and when the body will be over its landing."""
    found = []
    for part in parts:
        step_s = (part.end_s - part.start_s) / part.steps
        for k in range(part.steps):
            if (part.first + k) % 2 == side:
                start = part.start_s + k * step_s
                end = start + _SWING * step_s
                last = k >= part.steps - 2
                found.append((start, end, part.end_s if last else end + 0.6 * step_s))
    return found


def _body_at(times_s: Array, place: Array, yaw: Array, when: float) -> tuple[Array, float]:
    x, z = (float(np.interp(when, times_s, place[:, i])) for i in (0, 1))
    return np.array([x, z]), float(np.interp(when, times_s, yaw))


def _under(place: Array, yaw: float, side: int) -> Array:
    beside = _BESIDE * (1.0 if side == 0 else -1.0)
    return np.asarray(place + beside * np.array([np.cos(yaw), -np.sin(yaw)]))


def _heel_rise(to_body: Array, turned: Array) -> Array:
    """A foot left behind rises on its ball, so that the leg need not pull the hips down."""
    ahead = to_body[:, 0] * np.sin(turned) + to_body[:, 1] * np.cos(turned)
    return np.asarray(np.clip(0.45 * (ahead - 0.12), 0.0, 0.10))
