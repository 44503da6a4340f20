"""From a point in a base station's frame to the two angles at which its sweeps hit it.

The point is (X, Y, Z): X right, Y up, the station looks along -Z. The model is the stations' own:
its constants are what a station sends about itself (drivers/lighthouse/ootx.py).
"""

import math

import numpy as np
from numpy.polynomial import Polynomial

from lobstr_hw.drivers.lighthouse.angles import StationCalibration
from lobstr_hw.rotations import Array

__all__ = ["reproject"]

PLANE_TILT = np.array([math.pi / 6, -math.pi / 6])
OGEE = Polynomial([0.0, 0.0, 0.0076069798, 5.3685255e-6, 0.0028679863, -8.0108022e-6])
"""P(s): how far a curved plane of light moves at the elevation s."""
OGEE_SLOPE = OGEE.deriv()


def reproject(calibration: StationCalibration, points: Array) -> Array:
    """The angles at which a station's sweeps hit points.

    Args:
        calibration: of the station; a fresh ``StationCalibration(generation)`` is an ideal one.
        points: (..., 3) metres, in the station's frame.

    Returns:
        (..., 2) rad, axis or plane 0 and 1. Behind the station and beyond what the model can
        represent (arcsines are clipped) they mean nothing; they are NaN only at the origin.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        if calibration.generation == 1:
            return _gen1(calibration, points)
        return _gen2(calibration, points)


def _gen1(c: StationCalibration, points: Array) -> Array:
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    along, across = np.stack([x, y], -1), np.stack([y, x], -1)  # (..., 2)
    depth = -z[..., None]
    sign = np.array([-1.0, 1.0])
    th = math.pi / 2 + sign * np.arctan2(along, depth) - c.phase
    th = th - _arcsin(c.tilt * across / np.hypot(along, depth))
    th = th - c.gibmag * np.cos(c.gibphase + th)
    angle: Array = th + c.curve * np.arctan2(across, depth) ** 2 - math.pi / 2
    return angle


def _gen2(c: StationCalibration, points: Array) -> Array:
    x, y, z = points[..., :1], points[..., 1:2], points[..., 2:]
    tilt = c.tilt + PLANE_TILT
    bearing, level = np.arctan2(-z, x), np.hypot(x, z)
    a = np.tan(tilt) * y / level  # (..., 2): sine of how far off its middle the tilted plane hits
    q = c.ogeemag * np.sin(bearing - _arcsin(a) + c.ogeephase) + c.curve
    s = _arcsin(y / (np.hypot(level, y) * np.cos(tilt)))
    m, d = OGEE(s), OGEE_SLOPE(s)
    w = _arcsin(a + m * q / (np.cos(tilt) - d * q * np.sin(tilt)))
    turned = bearing - w
    angle: Array = turned + c.gibmag * np.sin(turned + c.gibphase) - c.phase - math.pi / 2
    return angle


def _arcsin(x: Array) -> Array:
    angle: Array = np.arcsin(np.clip(x, -1.0, 1.0))
    return angle
