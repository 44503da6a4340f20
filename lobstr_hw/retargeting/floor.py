"""The floor of a clip, told from the feet that stand on it: its tilt and its height."""

import numpy as np

from lobstr_hw.retargeting.speed import speed
from lobstr_hw.rotations import Array, rotation_between
from lobstr_hw.skeleton import TOE_BASE_HEIGHT

__all__ = ["floor_height", "floor_tilt"]

_STILL_M_S = 0.25
_NEAR_M = 0.03
_LEAST_S = 0.4
_SLOPES = (0.004, 0.06)  # 0.2 to 3.5 degrees: less is noise, more is no floor
_LEAST_WAY_M = 0.4
_OFF_M = 0.03


def floor_height(p_toes: Array, rate_hz: float) -> float:
    """Where the floor is, so that a standing toe base is :data:`TOE_BASE_HEIGHT` above it.

    The median height of toe bases that stand still within 3 cm of the lowest; where none stands
    still (a run, a lying person) the 1st percentile of the lower toe.

    Args:
        p_toes: (F, 2, 3) toe bases, standard size.
        rate_hz: of the frames.
    """
    height = p_toes[..., 1]
    low = np.percentile(height.min(axis=1), 1.0)
    v = np.linalg.norm(speed(p_toes, rate_hz, 0.1), axis=-1)
    stands = (v < _STILL_M_S) & (height < low + _NEAR_M)
    if stands.sum() >= _LEAST_S * rate_hz:
        low = np.median(height[stands])
    return float(low) - TOE_BASE_HEIGHT


def floor_tilt(p_toes: Array, rate_hz: float) -> Array:
    """The turn (3, 3) that levels a floor which is no floor level: identity where it is.

    Some laboratories' axes stand 1 to 2 degrees off the vertical: a walk then climbs by 1.5 cm a
    step. A plane through the standing toe bases tells; it counts only where they are spread over
    some way and it explains most of their differences in height.

    Args:
        p_toes: (F, 2, 3) toe bases, standard size.
        rate_hz: of the frames.
    """
    v = np.linalg.norm(speed(p_toes, rate_hz, 0.1), axis=-1)
    points = p_toes[v < _STILL_M_S]
    if len(points) < _LEAST_S * rate_hz:
        return np.eye(3)
    points = points - np.median(points, axis=0)
    slope = _plane(points)
    left = points[:, 1] - points[:, [0, 2]] @ slope
    steepness = float(np.linalg.norm(slope))
    way = np.std(points[:, [0, 2]] @ slope) / max(steepness, 1e-9)
    explained = np.median(np.abs(left - np.median(left))) < 0.5 * np.median(np.abs(points[:, 1]))
    if not (_SLOPES[0] < steepness < _SLOPES[1] and way > _LEAST_WAY_M and explained):
        return np.eye(3)
    return rotation_between(np.array([-slope[0], 1.0, -slope[1]]), np.array([0.0, 1.0, 0.0]))


def _plane(points: Array) -> Array:
    """Slopes (2,) along X and Z by least squares, those far off left out step by step."""
    keep = np.ones(len(points), dtype=bool)
    slope = np.zeros(2)
    for limit in (4.0 * _OFF_M, 2.0 * _OFF_M, _OFF_M):
        ground = np.column_stack([points[keep][:, [0, 2]], np.ones(keep.sum())])
        # a ridge: along a way never walked nothing is known, so the slope there is zero
        ridge = np.diag([0.05 * keep.sum()] * 2 + [0.0])
        solution = np.linalg.solve(ground.T @ ground + ridge, ground.T @ points[keep][:, 1])
        slope = solution[:2]
        off = points[:, 1] - points[:, [0, 2]] @ slope - solution[2]
        keep = np.abs(off) < limit
        if keep.sum() < 3:
            break
    return slope
