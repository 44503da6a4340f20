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
    f = state.filter
    if (
        gyro.std(axis=0).max() > settings.rest_gyro_rad_s
        or acc.std(axis=0).max() > settings.rest_acc_g
    ):
        return False
    if f is None:
        return True
    turning = np.linalg.norm(gyro.mean(axis=0) - f.gyro_bias)
    return bool(
        turning < 5.0 * settings.rest_gyro_rad_s and np.linalg.norm(f.v) < settings.rest_speed_m_s
    )


def rest_gyro(state: TrackerState, end: int, settings: TrackerSettings) -> Array:
    """The gyroscope's mean (3,) over that while."""
    i, j = np.searchsorted(state.imu.ticks, [end - int(settings.rest_s * TICKS_PER_S), end])
    return np.asarray(state.imu.gyro_rad_s[i:j].mean(axis=0))
