"""What a device's sensors should see from a pose, and how that changes with the pose.

Angles come from the stations' full model (drivers/lighthouse/reprojection.py); their derivatives
from the ideal station, which is within about a percent and costs a tenth: a step of a filter or of
least squares takes the residual from the one and the direction from the other.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lobstr_hw.drivers.lighthouse.angles import Angles, Ints, StationCalibration
from lobstr_hw.drivers.lighthouse.reprojection import (
    PLANE_TILT,
    Terms,
    gen1_angle,
    gen2_angle,
    terms_of,
)
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array

__all__ = ["Flags", "Hits", "Station", "Stations", "join_angles", "look", "planes", "take_angles"]

Flags = NDArray[np.bool_]

OFF_AXIS = math.tan(math.radians(70.0))
"""Gen1 lights 60 degrees to each side, Gen2 75 sideways and 55 up and down; beyond: reflections."""
NEAREST = 0.05
"""Metres before a station: nothing is nearer."""
PLANE_TANGENT = np.tan(PLANE_TILT)
GEN2_ELEVATION = math.tan(math.radians(57.0))
"""At 60 degrees the tilted planes run parallel to the ray, and the model ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """A base station that stands somewhere."""

    calibration: StationCalibration
    T_world_station: Pose


Stations = Mapping[int, Station]
"""Stations by the number that angles carry."""


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """Sensor hits of one device, brought to one moment of it by its gyroscope.

    Attributes:
        points: (m, 3) the sensor as it lay at the hit, in the IMU frame of the moment.
        normals: (m, 3) likewise.
        after_s: (m,) the hit's time less the moment.
        station, axis, sensor: (m,).
        angle_rad: (m,).
    """

    points: Array
    normals: Array
    after_s: Array
    station: Ints
    axis: Ints
    sensor: Ints
    angle_rad: Array

    def __len__(self) -> int:
        """Number of hits."""
        return len(self.angle_rad)

    def select(self, which: Flags) -> "Hits":
        """Those hits only."""
        return Hits(
            self.points[which],
            self.normals[which],
            self.after_s[which],
            self.station[which],
            self.axis[which],
            self.sensor[which],
            self.angle_rad[which],
        )


def take_angles(angles: Angles, which: Flags | slice) -> Angles:
    """Some of the angles."""
    return Angles(
        angles.ticks[which],
        angles.station[which],
        angles.axis[which],
        angles.sensor[which],
        angles.angle_rad[which],
    )


def join_angles(parts: Sequence[Angles]) -> Angles:
    """Angles one after the other, by time."""
    joined = Angles.join(list(parts))
    order = np.argsort(joined.ticks, kind="stable")
    return Angles(
        joined.ticks[order],
        joined.station[order],
        joined.axis[order],
        joined.sensor[order],
        joined.angle_rad[order],
    )


def look(
    stations: Stations, station: Ints, axis: Ints, points: Array, normals: Array
) -> tuple[Array, Array, Flags]:
    """Angles of points in the world, each for its own station and axis.

    Args:
        stations: must hold every number in ``station``.
        station: (m,).
        axis: (m,).
        points: (m, 3) in the world.
        normals: (m, 3) in the world.

    Returns:
        angle (m,), its derivative by the point in the world (m, 3), and whether such a hit can be:
        in the station's view, on a sensor that does not look away from it (m,).
    """
    table = _table(tuple(stations.items()))
    row = table.row[station]
    R = table.R[row]  # takes a station's frame into the world
    p = ((points - table.p[row])[:, None] @ R)[:, 0]  # R^T (x - c), in rows
    x, y, depth = p[:, 0], p[:, 1], -p[:, 2]
    facing = (normals[:, None] @ R)[:, 0]
    far = np.sqrt(x * x + y * y + depth * depth)
    ahead = facing[:, 0] * x + facing[:, 1] * y - facing[:, 2] * depth < 0.2 * far
    terms = table.terms.pick(2 * row + axis)
    with np.errstate(invalid="ignore", divide="ignore"):
        angle, slope, seen = _by_generation(table, row, axis, terms, x, y, depth)
    return angle, (R @ slope[..., None])[..., 0], seen & ahead


@dataclass(frozen=True, slots=True, eq=False)
class _Table:
    """All stations in arrays: a window has few hits, and each call of numpy costs as much as ten.

    ``row``: by number; ``terms``: two rows a station.
    """

    row: Ints
    R: Array
    p: Array
    gen1: Flags
    terms: Terms


@lru_cache(maxsize=32)
def _table(stations: tuple[tuple[int, Station], ...]) -> _Table:
    row = np.zeros(1 + max(number for number, _ in stations), dtype=np.int64)
    row[[number for number, _ in stations]] = np.arange(len(stations))
    terms = [terms_of(s.calibration) for _, s in stations]
    return _Table(
        row,
        np.stack([s.T_world_station.R for _, s in stations]),
        np.stack([s.T_world_station.p for _, s in stations]),
        np.array([s.calibration.generation == 1 for _, s in stations]),
        Terms(*(np.concatenate([getattr(t, f.name) for t in terms]) for f in fields(Terms))),
    )


def _by_generation(
    table: _Table, row: Ints, axis: Ints, terms: Terms, x: Array, y: Array, depth: Array
) -> tuple[Array, Array, Flags]:
    """Angle, its derivative in the station's frame, and whether it is in view."""
    if table.gen1.all():
        return _gen1(axis, terms, x, y, depth)
    if not table.gen1.any():
        return _gen2(axis, terms, x, y, depth)
    angle, slope, seen = _gen2(axis, terms, x, y, depth)
    i = np.flatnonzero(table.gen1[row])
    angle[i], slope[i], seen[i] = _gen1(axis[i], terms.pick(i), x[i], y[i], depth[i])
    return angle, slope, seen


def _gen1(axis: Ints, terms: Terms, x: Array, y: Array, depth: Array) -> tuple[Array, Array, Flags]:
    first = axis == 0
    along, across = np.where(first, x, y), np.where(first, y, x)
    angle = gen1_angle(terms, along, across, depth, np.where(first, -1.0, 1.0))
    # ideal: angle 0 = -atan2(x, -z), angle 1 = atan2(y, -z)
    sign = np.where(first, -1.0, 1.0) / (along**2 + depth**2)
    slope = np.empty((len(x), 3))
    slope[:, 0], slope[:, 1] = depth * sign * first, depth * sign * ~first
    slope[:, 2] = along * sign
    reach = OFF_AXIS * depth
    seen = (depth > NEAREST) & (np.abs(x) < reach) & (np.abs(y) < reach)
    return angle, slope, seen


def _gen2(axis: Ints, terms: Terms, x: Array, y: Array, depth: Array) -> tuple[Array, Array, Flags]:
    angle = gen2_angle(terms, x, y, depth)
    # ideal: atan2(-z, x) - asin(tan(tilt) y / n) - pi/2 with n = hypot(x, z)
    square = x * x + depth * depth
    n, tangent = np.sqrt(square), PLANE_TANGENT[axis]
    a = np.minimum(np.maximum(tangent * y / n, -0.99), 0.99)
    lift = 1.0 / np.sqrt(1.0 - a * a)
    slope = np.empty((len(x), 3))
    slope[:, 0] = (lift * a * x - depth) / square
    slope[:, 1] = -lift * tangent / n
    slope[:, 2] = -(x + lift * a * depth) / square
    # elevation is against the ray's own horizontal length, so it reaches further to the side
    seen = (depth > NEAREST) & (np.abs(x) < 4.0 * depth) & (np.abs(y) < GEN2_ELEVATION * n)
    return angle, slope, seen


def planes(stations: Stations, hits: Hits) -> tuple[Array, Array]:
    """The plane of light behind each hit, as an ideal station would sweep it.

    Returns:
        normals (m, 3) and offsets (m,) in the world, so that ``normal @ x = offset`` for every
        point x that the light is on; linear in x, hence good for a first guess.
    """
    normal, offset = np.zeros((len(hits), 3)), np.zeros(len(hits))
    for number in np.unique(hits.station):
        s, mine = stations[int(number)], np.flatnonzero(hits.station == number)
        k = hits.axis[mine]
        a = hits.angle_rad[mine] + s.calibration.phase[k]  # the largest of the calibration's terms
        if s.calibration.generation == 1:
            first, zero = k == 0, np.zeros_like(a)
            n = np.stack(
                [np.where(first, np.cos(a), zero), np.where(first, zero, np.cos(a)),
                 np.where(first, -np.sin(a), np.sin(a))],
                axis=1,
            )  # fmt: skip
        else:
            b = a + math.pi / 2
            n = np.stack([np.sin(b), np.tan(PLANE_TILT)[k], np.cos(b)], axis=1)
            n /= np.linalg.norm(n, axis=1, keepdims=True)
        normal[mine] = n @ s.T_world_station.R.T
        offset[mine] = normal[mine] @ s.T_world_station.p
    return normal, offset
