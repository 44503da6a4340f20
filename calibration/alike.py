"""Which two trackers turn alike: by their angular speeds, which know no frame."""

from collections.abc import Mapping

import numpy as np

from lobstr_hw.calibration.hand_eye import wobble
from lobstr_hw.calibration.track import Track
from lobstr_hw.rotations import Array, geodesic_angle

__all__ = ["ALIKE", "common_s", "most_alike", "turning_likeness"]

MOST_DELAY_S = 0.25
"""Between the stamps of two drivers; serial lines and radio take some tens of milliseconds."""
GRID_HZ = 100.0
SPEED_S = 0.04
ALIKE = 0.7
"""Two that are held together, however loosely, are above it; two hands that move are below."""


def common_s(a: Track, b: Track) -> float:
    """For how long both were seen."""
    if not (len(a) and len(b)):
        return 0.0
    return float(min(a.times_s[-1], b.times_s[-1]) - max(a.times_s[0], b.times_s[0]))


def turning_likeness(a: Track, b: Track) -> tuple[float, float]:
    """By how much later b turns as a does (seconds), and how alike it is then (1: the same).

    Args:
        a: of the one tracker.
        b: of the other; both were seen for some seconds at the same time.
    """
    start = max(a.times_s[0], b.times_s[0])
    times = np.arange(start, start + common_s(a, b), 1.0 / GRID_HZ)
    speed_a, speed_b = _speed(a, times), _speed(b, times)
    most = int(MOST_DELAY_S * GRID_HZ)
    middle = speed_a[most : len(times) - most]
    shifted = np.lib.stride_tricks.sliding_window_view(speed_b, len(middle))  # (2 most + 1, m)
    likeness = _correlation(middle, shifted)
    best = int(np.argmax(likeness))
    return (best - most) / GRID_HZ, float(likeness[best])


def _speed(track: Track, times_s: Array) -> Array:
    before, after = (track.at(times_s + side * SPEED_S / 2)[1] for side in (-1.0, 1.0))
    return geodesic_angle(before, after) / SPEED_S


def _correlation(a: Array, b: Array) -> Array:
    """Of (m,) with each of (k, m); 0 where one of them does not vary."""
    a = a - np.mean(a)
    b = b - np.mean(b, axis=-1, keepdims=True)
    both = np.linalg.norm(a) * np.linalg.norm(b, axis=-1)
    return np.asarray(b @ a / np.maximum(both, 1e-12))


def most_alike(
    of_a: Mapping[str, Track], of_b: Mapping[str, Track], least_s: float, least_wobble_rad: float
) -> tuple[str, str, float] | None:
    """The one tracker of each space that turn most alike.

    Args:
        of_a: serial -> track, of the one space.
        of_b: the same of the other space.
        least_s: both must have been seen for so long.
        least_wobble_rad: and turned by so much; what rests is alike to all that rests.

    Returns:
        Their serials, and how alike they are; None while none has turned enough.
    """
    turned = [
        {serial: t for serial, t in of.items() if len(t) > 1 and wobble(t.R) >= least_wobble_rad}
        for of in (of_a, of_b)
    ]
    pairs = {
        (a, b): turning_likeness(track_a, track_b)[1]
        for a, track_a in turned[0].items()
        for b, track_b in turned[1].items()
        if common_s(track_a, track_b) >= max(least_s, 4.0 * MOST_DELAY_S)
    }
    best = max(pairs, key=lambda pair: pairs[pair], default=None)
    return None if best is None else (*best, pairs[best])
