"""From a point in a base station's frame to the two angles at which its sweeps hit it.

The point is (X, Y, Z): X right, Y up, the station looks along -Z. The model is the stations' own:
its constants are what a station sends about itself (drivers/lighthouse/ootx.py).
"""

import math
from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import Ints, StationCalibration
from lobstr_hw.rotations import Array

__all__ = ["PLANE_TILT", "Terms", "gen1_angle", "gen2_angle", "reproject", "terms_of"]

PLANE_TILT = np.array([math.pi / 6, -math.pi / 6])
OGEE = (0.0076069798, 5.3685255e-6, 0.0028679863, -8.0108022e-6)
"""P(s) = s^2 (OGEE[0] + OGEE[1] s + ...): how far a curved plane of light moves at elevation s."""


@dataclass(frozen=True, slots=True, eq=False)
class Terms:
    """Constants of a calibration, each of any shape that goes with the points'.

    ``tilt`` and its functions are of the whole angle of a Gen2 plane, 30 degrees included.
    """

    phase: Array
    tilt: Array
    curve: Array
    gibphase: Array
    gibmag: Array
    ogeephase: Array
    ogeemag: Array
    sin_tilt: Array
    cos_tilt: Array
    tan_tilt: Array

    def pick(self, rows: Ints) -> "Terms":
        """Those of some rows."""
        return Terms(
            self.phase[rows], self.tilt[rows], self.curve[rows], self.gibphase[rows],
            self.gibmag[rows], self.ogeephase[rows], self.ogeemag[rows], self.sin_tilt[rows],
            self.cos_tilt[rows], self.tan_tilt[rows],
        )  # fmt: skip


def terms_of(c: StationCalibration) -> Terms:
    """Of axis or plane 0 and 1: (2,) each."""
    tilt = c.tilt if c.generation == 1 else c.tilt + PLANE_TILT
    return Terms(
        c.phase, tilt, c.curve, c.gibphase, c.gibmag, c.ogeephase, c.ogeemag,
        np.sin(tilt), np.cos(tilt), np.tan(tilt),
    )  # fmt: skip


def reproject(calibration: StationCalibration, points: Array) -> Array:
    """The angles at which a station's sweeps hit points.

    Args:
        calibration: of the station; a fresh ``StationCalibration(generation)`` is an ideal one.
        points: (..., 3) metres, in the station's frame.

    Returns:
        (..., 2) rad, axis or plane 0 and 1. Behind the station and beyond what the model can
        represent (arcsines are clipped) they mean nothing; they are NaN only at the origin.
    """
    terms = terms_of(calibration)
    x, y, depth = points[..., :1], points[..., 1:2], -points[..., 2:]
    with np.errstate(invalid="ignore", divide="ignore"):
        if calibration.generation == 1:
            along, across = np.concatenate([x, y], -1), np.concatenate([y, x], -1)
            return gen1_angle(terms, along, across, depth, np.array([-1.0, 1.0]))
        return gen2_angle(terms, x, y, depth)


def gen1_angle(c: Terms, along: Array, across: Array, depth: Array, sign: Array) -> Array:
    """The angle of an axis that turns along one direction; ``sign``: -1 of axis 0, 1 of axis 1."""
    th = math.pi / 2 + sign * np.arctan2(along, depth) - c.phase
    th = th - _arcsin(c.tilt * across / np.hypot(along, depth))
    th = th - c.gibmag * np.cos(c.gibphase + th)
    angle: Array = th + c.curve * np.arctan2(across, depth) ** 2 - math.pi / 2
    return angle


def gen2_angle(c: Terms, x: Array, y: Array, depth: Array) -> Array:
    """The angle of a plane."""
    bearing, level = np.arctan2(depth, x), np.hypot(x, depth)
    a = c.tan_tilt * y / level  # sine of how far off its middle the tilted plane hits
    q = c.ogeemag * np.sin(bearing - _arcsin(a) + c.ogeephase) + c.curve
    s = _arcsin(y / (np.hypot(level, y) * c.cos_tilt))
    p0, p1, p2, p3 = OGEE
    m = s * s * (p0 + s * (p1 + s * (p2 + s * p3)))
    d = s * (2 * p0 + s * (3 * p1 + s * (4 * p2 + s * (5 * p3))))
    turned = bearing - _arcsin(a + m * q / (c.cos_tilt - d * q * c.sin_tilt))
    angle: Array = turned + c.gibmag * np.sin(turned + c.gibphase) - c.phase - math.pi / 2
    return angle


def _arcsin(x: Array) -> Array:
    angle: Array = np.arcsin(np.minimum(np.maximum(x, -1.0), 1.0))
    return angle
