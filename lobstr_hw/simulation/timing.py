"""When each part of a movement begins and ends, and how it runs in between."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.rotations import Array
from lobstr_hw.simulation.footsteps import minimum_jerk
from lobstr_hw.simulation.habits import Habits, Performance

__all__ = ["Plan", "bump", "cruise", "ramp", "waves"]


@dataclass(frozen=True, slots=True)
class Plan:
    """When each part begins and ends, in seconds."""

    gestures: tuple[float, float]
    lower: tuple[float, float]
    bow: tuple[float, float]
    walk: tuple[float, float]
    turn: tuple[float, float]
    end_s: float

    @staticmethod
    def of(habits: Habits, now: Performance) -> "Plan":
        """Head and hands first, then the rest one after the other."""
        pace = 1.0 / (habits.tempo * now.tempo)
        start = 0.2 * pace if now.arms_out else 0.9 * pace
        at = start + 2.6 * pace
        lower = at - 0.1 * pace if now.arms_out else 0.0
        spans = {"gestures": (start, at), "lower": (lower, lower + 1.0 * pace)}
        at += 0.35 * pace if now.arms_out else 0.0
        walk_s = 0.6 * (now.steps + 1) * pace  # the last one only closes
        turn_s = (0.6 + abs(now.turn_rad) / np.deg2rad(360.0) * 1.9) * pace
        lengths = {"bow": 1.8 * pace, "walk": walk_s, "turn": turn_s}
        order = ("bow", "walk", "turn") if now.bow_first else ("walk", "turn", "bow")
        for name in order:
            spans[name] = (at, at + lengths[name])
            at += lengths[name] + 0.05 * pace
        return Plan(**spans, end_s=at + 0.2)


def ramp(t: Array, span: tuple[float, float]) -> Array:
    """From 0 up to 1 for good."""
    return minimum_jerk((t - span[0]) / (span[1] - span[0]))


def bump(t: Array, span: tuple[float, float], hold: float = 0.2) -> Array:
    """From 0 up to 1, a while there, and down again."""
    a = (t - span[0]) / (span[1] - span[0])
    rise = 0.5 - hold / 2.0
    return minimum_jerk(a / rise) - minimum_jerk((a - rise - hold) / rise)


def waves(t: Array, span: tuple[float, float], count: int, sides: Array) -> Array:
    """``count`` times to one side and to the other, each as far as ``sides`` (2,) says."""
    a = np.clip((t - span[0]) / (span[1] - span[0]), 0.0, 1.0)
    wave = np.sin(2.0 * np.pi * count * a) * np.minimum(1.0, 8.0 * np.minimum(a, 1.0 - a))
    return np.asarray(np.where(wave > 0.0, sides[0], sides[1]) * wave)


def cruise(t: Array, span: tuple[float, float]) -> Array:
    """From 0 to 1 at an even speed but for a quarter at either end."""
    a = np.clip((t - span[0]) / (span[1] - span[0]), 0.0, 1.0)
    e = 0.25
    start, end = _minimum_jerk_integral(a / e) * e, _minimum_jerk_integral((1.0 - a) / e) * e
    middle = np.clip(a, e, 1.0 - e) - e
    whole = 1.0 - e
    return np.asarray((start + middle + 0.5 * e - end) / whole)


def _minimum_jerk_integral(t: Array) -> Array:
    """Way covered while the speed goes from 0 to 1 as :func:`minimum_jerk` has it; 0.5 at 1."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t**4 * (2.5 - 3.0 * t + t**2))
