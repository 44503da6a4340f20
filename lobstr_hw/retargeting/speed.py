"""Velocities from positions, over a span long enough to drown the noise."""

import numpy as np

from lobstr_hw.rotations import Array

__all__ = ["speed"]


def speed(p: Array, rate_hz: float, span_s: float) -> Array:
    """Velocity (F, ..., 3) over a centred span, shortened at the ends."""
    k = max(1, round(span_s * rate_hz / 2.0))
    i = np.arange(len(p))
    a, b = np.maximum(i - k, 0), np.minimum(i + k, len(p) - 1)
    dt = np.maximum(b - a, 1) / rate_hz
    return np.asarray((p[b] - p[a]) / dt.reshape(-1, *(1,) * (p.ndim - 1)))
