"""What a Lighthouse gets wrong: jitter, drift, jumps and drop-outs. Each can be switched off."""

from dataclasses import dataclass, replace

import numpy as np

from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, from_rotation_vector
from lobstr_hw.simulation.noise import ornstein_uhlenbeck

__all__ = ["TrackingErrors", "disturbed"]


@dataclass(frozen=True, slots=True)
class TrackingErrors:
    """Sizes of the errors; a zero switches one off.

    Attributes:
        jitter_m, jitter_rad: white, per sample; sub-millimetre with two stations in sight.
        drift_m, drift_rad: slow wander, deviation of an Ornstein-Uhlenbeck process.
        drift_memory_s: over which the drift forgets.
        jumps_per_minute: reflections, of each tracker: up to 0.2 s off, said to be tracked.
        jump_m: mean size of a jump.
        dropouts_per_minute: of each tracker; 0.1 to 1 s without sight, tracked False.
        coast_s: for so long a blind tracker goes on at its speed (fading), then it holds.
    """

    jitter_m: float = 0.0003
    jitter_rad: float = np.deg2rad(0.02)
    drift_m: float = 0.002
    drift_rad: float = np.deg2rad(0.1)
    drift_memory_s: float = 20.0
    jumps_per_minute: float = 0.3
    jump_m: float = 0.04
    dropouts_per_minute: float = 0.3
    coast_s: float = 0.1

    @staticmethod
    def none() -> "TrackingErrors":
        """A perfect tracking system."""
        return replace(
            TrackingErrors(),
            jitter_m=0.0,
            jitter_rad=0.0,
            drift_m=0.0,
            drift_rad=0.0,
            jumps_per_minute=0.0,
            dropouts_per_minute=0.0,
        )


def disturbed(
    errors: TrackingErrors, rng: np.random.Generator, times_s: Array, p: Array, R: Array
) -> tuple[Array, Array, Bools]:
    """Tracker poses as a tracking system would report them.

    Args:
        errors: how much.
        rng: seeded by the caller.
        times_s: (m,) even steps.
        p: (m, trackers, 3) true positions, metres.
        R: (m, trackers, 3, 3) true rotations.

    Returns:
        p, R and tracked (m, trackers).
    """
    m, trackers = p.shape[:2]
    channels = trackers * 3

    def slow(size: float) -> Array:
        return ornstein_uhlenbeck(rng, times_s, channels, size, errors.drift_memory_s)

    off_p = (slow(errors.drift_m) + rng.normal(0.0, 1.0, (m, channels)) * errors.jitter_m).reshape(
        m, trackers, 3
    )
    off_R = slow(errors.drift_rad) + rng.normal(0.0, 1.0, (m, channels)) * errors.jitter_rad
    off_p = off_p + _jumps(errors, rng, times_s, trackers)
    p = p + off_p
    R = R @ from_rotation_vector(off_R.reshape(m, trackers, 3))
    tracked = np.ones((m, trackers), dtype=bool)
    for tracker in range(trackers):
        for begin, end in _spans(rng, times_s, errors.dropouts_per_minute, (0.1, 1.0)):
            tracked[begin:end, tracker] = False
            _lose_sight(errors, times_s, p[:, tracker], R[:, tracker], begin, end)
    return p, R, tracked


def _spans(
    rng: np.random.Generator, times_s: Array, per_minute: float, length_s: tuple[float, float]
) -> list[tuple[int, int]]:
    """Random index ranges, by a Poisson process; none at the very first sample."""
    duration = times_s[-1] - times_s[0]
    count = rng.poisson(per_minute * duration / 60.0)
    begin = times_s[0] + rng.uniform(0.0, 1.0, count) * duration
    end = begin + rng.uniform(*length_s, count)
    spans = np.searchsorted(times_s, np.stack([begin, end], axis=-1))
    return [(max(int(a), 1), int(b)) for a, b in spans if b > max(a, 1)]


def _jumps(
    errors: TrackingErrors, rng: np.random.Generator, times_s: Array, trackers: int
) -> Array:
    off = np.zeros((len(times_s), trackers, 3))
    for tracker in range(trackers):
        for begin, end in _spans(rng, times_s, errors.jumps_per_minute, (0.02, 0.2)):
            direction = rng.normal(size=3)
            size = errors.jump_m * rng.uniform(0.5, 1.5)
            off[begin:end, tracker] += size * direction / np.linalg.norm(direction)
    return off


def _lose_sight(
    errors: TrackingErrors, times_s: Array, p: Array, R: Array, begin: int, end: int
) -> None:
    """Overwrite begin:end with the last pose, coasting at the last speed until that has faded."""
    since = times_s[begin:end] - times_s[begin - 1]
    step_s = times_s[begin] - times_s[begin - 1]
    earlier = max(begin - 3, 0)  # over three steps, so that jitter does not become speed
    velocity = (p[begin - 1] - p[earlier]) / (step_s * max(begin - 1 - earlier, 1))
    fade = max(errors.coast_s, 1e-9)
    t = np.minimum(since, fade)
    p[begin:end] = p[begin - 1] + (t - t**2 / (2.0 * fade))[:, None] * velocity
    R[begin:end] = R[begin - 1]
