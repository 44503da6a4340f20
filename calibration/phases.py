"""What somebody is doing, told from four roughly calibrated joints."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, heading_angle, to_rotation_vector, transpose

__all__ = ["Phases", "angular_velocity", "rate_of", "tell_phases"]

_TILTED = np.deg2rad(8.0)
_BENT = np.deg2rad(12.0)
_TURNING = np.deg2rad(40.0)  # per second
_STRAIGHT = np.deg2rad(25.0)
_STILL = np.deg2rad(25.0)
_WALKING_M_S = 0.25
_WINDOW_S = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Phases:
    """Which frames (m,) are what; one may be several.

    Attributes:
        upright: the trunk as upright as most of the time.
        bowing: the trunk bent forward, on the spot.
        walking: going somewhere without turning.
        turning: the body turns.
        still: the pelvis neither turns nor goes anywhere.
    """

    upright: Bools
    bowing: Bools
    walking: Bools
    turning: Bools
    still: Bools


def rate_of(values: Array, rate_hz: float, window_s: float = _WINDOW_S) -> Array:
    """Derivative (m, ...) of values (m, ...) over a window around each frame."""
    half = max(1, round(window_s * rate_hz / 2.0))
    i = np.arange(len(values))
    before, after = np.maximum(i - half, 0), np.minimum(i + half, len(values) - 1)
    span = (after - before).reshape(-1, *(1,) * (values.ndim - 1)) / rate_hz
    return np.asarray((values[after] - values[before]) / span)


def angular_velocity(R: Array, rate_hz: float) -> Array:
    """Of rotations (m, 3, 3) in their own frame (m, 3), over two frames either side."""
    i = np.arange(len(R))
    before, after = np.maximum(i - 2, 0), np.minimum(i + 2, len(R) - 1)
    turn = to_rotation_vector(transpose(R[before]) @ R[after])
    return np.asarray(turn * rate_hz / (after - before)[:, None])


def tell_phases(p: Array, R: Array, rate_hz: float) -> Phases:
    """Tell what is going on.

    Args:
        p: (m, 4, 3) joints, roughly.
        R: (m, 4, 3, 3) of the joints, roughly.
        rate_hz: of the frames.
    """
    line = p[:, 0] - p[:, 3]
    tilt = np.arctan2(np.hypot(line[:, 0], line[:, 2]), line[:, 1])
    usual = float(np.percentile(tilt, 30.0))
    speed = np.linalg.norm(rate_of(p[:, 3][:, [0, 2]], rate_hz), axis=-1)
    yaw_rate = np.abs(rate_of(np.unwrap(heading_angle(R[:, 3])[0]), rate_hz))
    turn = np.linalg.norm(angular_velocity(R[:, 3], rate_hz), axis=-1)
    upright = tilt < usual + _TILTED
    return Phases(
        upright=upright,
        bowing=(tilt > usual + 0.5 * _BENT) & (yaw_rate < _TURNING),
        walking=upright & (speed > _WALKING_M_S) & (yaw_rate < _STRAIGHT),
        turning=yaw_rate > _TURNING,
        still=upright & (turn < _STILL) & (speed < _WALKING_M_S),
    )
