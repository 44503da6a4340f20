"""Did a tracker move on its joint while the person stood still? A step that does not come back."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.recording import RATE_HZ, Movement
from lobstr_hw.rotations import Array, rotation_mean, to_rotation_vector, transpose

__all__ = ["Step", "steps_of"]

_SIDE = round(0.2 * RATE_HZ)
_GAP = round(0.3 * RATE_HZ)  # a strap gives way within this time
_EXCURSION = round(0.2 * RATE_HZ)  # as long as a jump of the tracking lasts


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """How far each tracker moved at its worst moment, beyond the sway before and after.

    Attributes:
        m: (4,) metres.
        rad: (4,) radians.
        time_s: (4,) when.
    """

    m: Array
    rad: Array
    time_s: Array


def steps_of(pose: Movement) -> Step:
    """The largest step of each tracker.

    A line through the 0.2 s before and one through the 0.2 s after each moment (0.3 s of it left
    out) disagree in the middle by what is no sway: people sway too slowly. Excursions shorter than
    a jump of the tracking are taken out first.

    Args:
        pose: the trackers while somebody stands still.
    """
    count = len(pose) - 2 * (_SIDE + _EXCURSION) - _GAP + 1
    if count < 1:
        return Step(np.zeros(4), np.zeros(4), np.zeros(4))
    turned = to_rotation_vector(transpose(rotation_mean(pose.R)) @ pose.R)
    off = [
        np.linalg.norm(_disagreement(_without_excursions(values), count), axis=-1)
        for values in (pose.p, turned)
    ]  # (count, 4)
    # a person who moves takes more than one tracker along
    alone = [step * (_third(step) < 0.5 * step) for step in off]
    at = np.argmax(alone[0] / 0.03 + alone[1] / 0.17, axis=0)
    times = pose.times_s[at + _EXCURSION + _SIDE + _GAP // 2]
    return Step(np.max(alone[0], axis=0), np.max(alone[1], axis=0), times)


def _third(values: Array) -> Array:
    """The third largest of four, (n, 4) -> (n, 1)."""
    return np.asarray(np.sort(values, axis=1)[:, 1:2])


def _without_excursions(values: Array) -> Array:
    """A running median over twice the excursion; (m, ...) -> (m - 2 * excursion, ...)."""
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * _EXCURSION + 1, axis=0)
    return np.asarray(np.median(windows, axis=-1))


def _disagreement(values: Array, count: int) -> Array:
    """Line after minus line before, in the middle of the gap: (m, ...) -> (count, ...)."""
    t = np.arange(_SIDE) - (_SIDE - 1) / 2.0
    ahead = (_SIDE - 1) / 2.0 + (_GAP + 1) / 2.0  # from a side's middle to the gap's
    slope = t / np.sum(t**2)
    before = 1.0 / _SIDE + ahead * slope
    after = 1.0 / _SIDE - ahead * slope
    out = []
    for i in range(count):
        a = values[i : i + _SIDE]
        b = values[i + _SIDE + _GAP : i + 2 * _SIDE + _GAP]
        out.append(np.tensordot(after, b, 1) - np.tensordot(before, a, 1))
    return np.array(out)
