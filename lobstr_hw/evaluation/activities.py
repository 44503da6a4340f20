"""What people are doing in each frame, told from the pelvis, the head and the hands alone."""

from enum import StrEnum

import numpy as np
import numpy.typing as npt

from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.proportions import STANDARD_ARM
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

__all__ = ["Activity", "activities"]

SMOOTHING_S = 0.5
RUNNING_M_S = 2.2
GOING_M_S = 0.4
TURNING_RAD_S = np.deg2rad(45.0)
RISING_M_S = 0.2
LOW_HIPS_M = 0.78
BENT_HIPS_M = 0.92
REACH_OF_ARM = 1.0

_HEAD = FOUR_POINTS.index(TrackerRole.HEAD)
_HANDS = [FOUR_POINTS.index(r) for r in (TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND)]


class Activity(StrEnum):
    """Each frame has one; where two would fit, the one further up."""

    SINKING = "sitting or crouching down, standing up"
    LOW = "low: crouching, sitting, kneeling"
    RUNNING = "running"
    BACKWARDS = "walking backwards"
    SIDEWAYS = "side steps"
    WALKING = "walking"
    TURNING = "turning on the spot"
    REACHING = "standing and reaching"
    STANDING = "standing"


def activities(clip: Truth) -> npt.NDArray[np.str_]:
    """The activity (frames,) of each frame of a clip.

    Speeds are means over half a second around the frame. Lengths are of the standard skeleton (hips
    at 1.0 m): low is under 0.78 m; sinking is faster than 0.2 m/s under 0.92 m; running is faster
    than 2.2 m/s; going than 0.4 m/s, forwards within 45 degrees of the heading and backwards beyond
    135; turning is faster than 45 degrees/s; reaching has a wrist over the head, or an arm's length
    away from the vertical through it.
    """
    v = _mean_rate(clip.p_hips, clip.rate_hz)
    speed = np.hypot(v[:, 0], v[:, 2])
    ahead = np.abs(np.arctan2(*_sideways_and_ahead(clip.R_ref, v)))
    turning = np.abs(_mean_rate(np.unwrap(_yaw(clip.R_ref)), clip.rate_hz)) > TURNING_RAD_S
    height = clip.p_hips[:, 1]
    going = speed > GOING_M_S
    cases = {
        Activity.SINKING: (np.abs(v[:, 1]) > RISING_M_S) & (height < BENT_HIPS_M) & ~going,
        Activity.LOW: height < LOW_HIPS_M,
        Activity.RUNNING: speed > RUNNING_M_S,
        Activity.BACKWARDS: going & (ahead > 0.75 * np.pi),
        Activity.SIDEWAYS: going & (ahead > 0.25 * np.pi),
        Activity.WALKING: going,
        Activity.TURNING: turning,
        Activity.REACHING: _reaching(clip.p),
    }
    return np.select(list(cases.values()), [str(a) for a in cases], str(Activity.STANDING))


def _mean_rate(values: Array, rate_hz: float) -> Array:
    """Rate of change (frames, ...), per second."""
    reach = round(0.5 * SMOOTHING_S * rate_hz)
    frame = np.arange(len(values))
    first, last = np.maximum(frame - reach, 0), np.minimum(frame + reach, len(values) - 1)
    elapsed_s = np.maximum(last - first, 1) / rate_hz
    return np.asarray((values[last] - values[first]) / _beside(elapsed_s, values))


def _beside(scale: Array, values: Array) -> Array:
    return scale.reshape(-1, *(1,) * (values.ndim - 1))


def _sideways_and_ahead(R_ref: Array, v: Array) -> tuple[Array, Array]:
    local = (np.swapaxes(R_ref, -1, -2) @ v[..., None])[..., 0]
    return local[:, 0], local[:, 2]


def _yaw(R_ref: Array) -> Array:
    return np.asarray(np.arctan2(R_ref[:, 0, 2], R_ref[:, 2, 2]))


def _reaching(p: Array) -> npt.NDArray[np.bool_]:
    away = p[:, _HANDS] - p[:, None, _HEAD]
    far = np.hypot(away[..., 0], away[..., 2]) > REACH_OF_ARM * STANDARD_ARM
    return np.asarray((far | (away[..., 1] > 0.0)).any(axis=1))
