"""Which frames are drawn how often: so that neither one person nor one way of moving is all.

Most captures are of few people who stand or walk forwards; running, side steps and low hips, where
errors are largest, are one or two frames in a hundred.
"""

import numpy as np
import numpy.typing as npt

from lobstr_hw.features import reference_frames
from lobstr_hw.rotations import Array
from lobstr_hw.training.config import CarriedSettings
from lobstr_hw.training.dataset import RATE_HZ, Clips, Float32

__all__ = ["frame_weights", "kinds_of_motion"]

Ints = npt.NDArray[np.int64]

SMOOTHING_S = 0.5
SPEEDS_M_S = (0.2, 0.7, 1.3, 2.2)
DIRECTIONS = 3
LOW_HIPS_M = 0.78
STANDING = 0


def frame_weights(clips: Clips, settings: CarriedSettings) -> Array:
    """How likely each frame (frames,) is to be the anchor of an episode; sums to 1."""
    people = np.repeat(np.unique(clips.subjects, return_inverse=True)[1], np.diff(clips.start))
    weights = _share(people, settings.people_power) * _share(
        kinds_of_motion(clips), settings.motion_power
    )
    # a second of sprint must not be learnt by heart
    weights = np.minimum(weights, settings.most_often * weights.mean())
    return np.asarray(weights / weights.sum())


def _share(group: Ints, power: float) -> Array:
    """Weights that give each group of n frames a share in proportion to n ** power."""
    frames = np.bincount(group)
    return np.asarray(np.maximum(frames, 1)[group] ** (power - 1.0))


def kinds_of_motion(clips: Clips) -> Ints:
    """A number (frames,) for speed, direction against the heading, and whether the hips are low."""
    pieces = zip(clips.start[:-1], clips.start[1:], strict=True)
    return np.concatenate([_kinds(clips.p[a:b, 0], clips.R[a:b, 0]) for a, b in pieces])


def _kinds(p_hips: Float32, R_hips: Float32) -> Ints:
    forward = reference_frames(R_hips.astype(np.float64))[:, :, 2]
    v = _mean_velocity(p_hips.astype(np.float64))
    ahead = np.arctan2(np.abs(np.cross(forward, v)[:, 1]), np.sum(forward * v, axis=1))
    speed = np.digitize(np.linalg.norm(v, axis=1), SPEEDS_M_S)
    # forwards within 45 degrees, sideways, backwards beyond 135
    direction = np.where(speed == STANDING, 0, np.digitize(ahead, (np.pi / 4, 3 * np.pi / 4)))
    low = p_hips[:, 1] < LOW_HIPS_M
    return np.asarray((speed * DIRECTIONS + direction) * 2 + low, dtype=np.int64)


def _mean_velocity(p: Array) -> Array:
    """Horizontal (frames, 3), metres per second, over half a second around each frame."""
    reach = round(0.5 * SMOOTHING_S * RATE_HZ)
    frame = np.arange(len(p))
    first, last = np.maximum(frame - reach, 0), np.minimum(frame + reach, len(p) - 1)
    elapsed_s = np.maximum(last - first, 1) / RATE_HZ
    return np.asarray((p[last] - p[first]) * np.array([1.0, 0.0, 1.0]) / elapsed_s[:, None])
