"""Whether a device lies still, by its IMU."""

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S
from lobstr_hw.drivers.lighthouse.tracker_state import TrackerSettings, TrackerState
from lobstr_hw.rotations import Array

__all__ = ["is_still", "rest_gyro"]


def is_still(state: TrackerState, end: int, settings: TrackerSettings) -> bool:
    """Nothing moved for a while up to a moment, nor does light say that it does."""
    i, j = np.searchsorted(state.imu.ticks, [end - int(settings.rest_s * TICKS_PER_S), end])
    if j - i < 8 or state.imu.ticks[i] > end - 0.8 * settings.rest_s * TICKS_PER_S:
        return False
    gyro, acc = state.imu.gyro_rad_s[i:j], state.imu.acc_g[i:j]
    mean, variance = _spread(gyro)
    if variance > settings.rest_gyro_rad_s**2 or _spread(acc)[1] > settings.rest_acc_g**2:
        return False
    f = state.filter
    if f is None:
        return True
    turning = mean - f.gyro_bias
    return bool(
        turning @ turning < (5.0 * settings.rest_gyro_rad_s) ** 2
        and f.v @ f.v < settings.rest_speed_m_s**2
    )


def _spread(x: Array) -> tuple[Array, float]:
    """Mean (3,), and the largest of the variances, of rows (n, 3)."""
    mean = np.add.reduce(x, axis=0) / len(x)
    off = x - mean
    return mean, float((np.add.reduce(off * off, axis=0) / len(x)).max())


def rest_gyro(state: TrackerState, end: int, settings: TrackerSettings) -> Array:
    """The gyroscope's mean (3,) over that while."""
    i, j = np.searchsorted(state.imu.ticks, [end - int(settings.rest_s * TICKS_PER_S), end])
    return np.asarray(np.add.reduce(state.imu.gyro_rad_s[i:j], axis=0) / (j - i))
