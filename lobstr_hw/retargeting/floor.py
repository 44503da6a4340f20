"""The floor of a clip, told from the feet that stand on it."""

import numpy as np

from lobstr_hw.retargeting.evidence import speed
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import TOE_BASE_HEIGHT

__all__ = ["floor_height"]

_STILL_M_S = 0.25
_NEAR_M = 0.03
_LEAST_S = 0.4


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
