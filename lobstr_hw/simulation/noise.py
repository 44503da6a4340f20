"""Random signals in time, seeded by the caller."""

import numpy as np

from lobstr_hw.rotations import Array, from_quat_xyzw

__all__ = ["ornstein_uhlenbeck", "random_rotations", "rotation_vectors", "smooth_noise"]


def smooth_noise(
    rng: np.random.Generator, times_s: Array, channels: int, deviation: float
) -> Array:
    """A person's sway (m, channels): a sum of slow waves, 0.1 to 0.7 Hz, of this deviation."""
    waves = 6
    frequency = rng.uniform(0.1, 0.7, (channels, waves))
    phase = rng.uniform(0.0, 2.0 * np.pi, (channels, waves))
    # body sway has most of its power at the low end
    weight = 1.0 / frequency
    weight *= np.sqrt(2.0) / np.linalg.norm(weight, axis=-1, keepdims=True)
    angle = 2.0 * np.pi * frequency * times_s[:, None, None] + phase
    return np.asarray(deviation * np.sum(weight * np.sin(angle), axis=-1))


def ornstein_uhlenbeck(
    rng: np.random.Generator, times_s: Array, channels: int, deviation: float, memory_s: float
) -> Array:
    """A slow random walk held near zero (m, channels), by exact steps at 10 per memory."""
    step_s = memory_s / 10.0
    knots = np.arange(times_s[0], times_s[-1] + 2.0 * step_s, step_s)
    keep = np.exp(-0.1)
    values = rng.normal(0.0, deviation, (len(knots), channels))
    for i in range(1, len(knots)):
        values[i] = keep * values[i - 1] + np.sqrt(1.0 - keep**2) * values[i]
    columns = [np.interp(times_s, knots, values[:, c]) for c in range(channels)]
    return np.stack(columns, axis=-1)


def rotation_vectors(rng: np.random.Generator, n: int, largest_rad: float) -> Array:
    """Turns (n, 3) about any axis by a uniform angle of at most ``largest_rad``."""
    axis = rng.normal(size=(n, 3))
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    return np.asarray(axis * rng.uniform(0.0, largest_rad, (n, 1)))


def random_rotations(rng: np.random.Generator, n: int) -> Array:
    """Uniform on all rotations (n, 3, 3)."""
    return from_quat_xyzw(rng.normal(size=(n, 4)))
