"""What a device's sensors should see from a pose, and how that changes with the pose.

Angles come from the stations' full model (drivers/lighthouse/reprojection.py); their derivatives
from the ideal station, which is within about a percent and costs a tenth: a step of a filter or of
least squares takes the residual from the one and the direction from the other.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lobstr_hw.drivers.lighthouse.angles import Angles, Ints, StationCalibration
from lobstr_hw.drivers.lighthouse.reprojection import PLANE_TILT, reproject
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array

__all__ = ["Flags", "Hits", "Station", "Stations", "join_angles", "look", "planes", "take_angles"]

Flags = NDArray[np.bool_]

OFF_AXIS = math.tan(math.radians(70.0))
"""Gen1 lights 60 degrees to each side, Gen2 75 sideways and 55 up and down; beyond: reflections."""
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
    angle, slope = np.zeros(len(points)), np.zeros((len(points), 3))
    seen = np.zeros(len(points), dtype=bool)
    for number in np.unique(station):
        s, mine = stations[int(number)], np.flatnonzero(station == number)
        R, generation = s.T_world_station.R, s.calibration.generation
        p = (points[mine] - s.T_world_station.p) @ R  # R^T (x - c), in rows
        k = axis[mine]
        angle[mine] = reproject(s.calibration, p)[np.arange(len(mine)), k]
        slope[mine] = _ideal_slope(generation, p, k) @ R.T
        facing = np.einsum("ij,ij->i", normals[mine] @ R, p) < 0.2 * np.linalg.norm(p, axis=1)
        seen[mine] = facing & _in_view(generation, p)
    return angle, slope, seen


def _in_view(generation: int, p: Array) -> Flags:
    x, y, depth = np.abs(p[:, 0]), np.abs(p[:, 1]), -p[:, 2]
    near = (depth > 0.05) & (x < OFF_AXIS * depth) & (y < OFF_AXIS * depth)
    if generation == 1:
        return np.asarray(near)
    # Gen2's elevation is against the ray's own horizontal length, so it reaches further to the side
    level = np.hypot(x, depth)
    return np.asarray((depth > 0.05) & (x < 4.0 * depth) & (y < GEN2_ELEVATION * level))


def _ideal_slope(generation: int, p: Array, axis: Ints) -> Array:
    """Derivative (m, 3) by the point in the station's frame, of the ideal station's angle."""
    x, y, z = p[:, 0], p[:, 1], p[:, 2]
    zero = np.zeros_like(x)
    if generation == 1:
        # angle 0 = -atan2(x, -z), angle 1 = atan2(y, -z)
        side = np.where(axis == 0, x, y)
        sign = np.where(axis == 0, -1.0, 1.0) / (side**2 + z**2)
        along, deep = -z * sign, side * sign
        first = axis == 0
        return np.stack([np.where(first, along, zero), np.where(first, zero, along), deep], axis=1)
    # angle = atan2(-z, x) - asin(tan(tilt) y / n) - pi/2 with n = hypot(x, z)
    square = x**2 + z**2
    n, tangent = np.sqrt(square), np.tan(PLANE_TILT)[axis]
    a = np.clip(tangent * y / n, -0.99, 0.99)
    lift = 1.0 / np.sqrt(1.0 - a**2)
    return np.stack(
        [
            z / square + lift * a * x / square,
            -lift * tangent / n,
            -x / square + lift * a * z / square,
        ],
        axis=1,
    )


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
