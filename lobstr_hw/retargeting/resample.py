"""From the clip's rate to 45 Hz by cubic interpolation."""

import numpy as np

from lobstr_hw.rotations import Array, from_quat_xyzw, to_quat_xyzw

__all__ = ["resample_points", "resample_rotations", "resample_times"]


def resample_times(frames: int, rate_in_hz: float, rate_out_hz: float) -> Array:
    """Where the new frames are, counted in old frames."""
    # a file's frame time is rounded, so the last new frame may be said to fall just after its end
    count = int((frames - 1) / rate_in_hz * rate_out_hz + 1e-2) + 1
    return np.asarray(np.minimum(np.arange(count) * (rate_in_hz / rate_out_hz), frames - 1.0))


def resample_points(values: Array, at: Array) -> Array:
    """Catmull-Rom through values (F, ...) at fractional frames ``at`` (n,)."""
    last = len(values) - 1
    i = np.clip(np.floor(at).astype(int), 0, max(last - 1, 0))
    f = (at - i).reshape(-1, *(1,) * (values.ndim - 1))
    a, b = values[i], values[np.minimum(i + 1, last)]
    before = np.where((i > 0).reshape(f.shape), values[np.maximum(i - 1, 0)], 2.0 * a - b)
    after = np.where((i + 2 <= last).reshape(f.shape), values[np.minimum(i + 2, last)], 2.0 * b - a)
    slope_a, slope_b = 0.5 * (b - before), 0.5 * (after - a)
    # Hermite form
    return np.asarray(
        a
        + f * slope_a
        + f**2 * (3.0 * (b - a) - 2.0 * slope_a - slope_b)
        + f**3 * (2.0 * (a - b) + slope_a + slope_b)
    )


def resample_rotations(R: Array, at: Array) -> Array:
    """The same for rotations (F, ..., 3, 3), through quaternions of one sign."""
    q = to_quat_xyzw(R)
    flips = np.where(np.sum(q[1:] * q[:-1], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    q[1:] *= np.cumprod(flips, axis=0)
    return from_quat_xyzw(resample_points(q, at))
