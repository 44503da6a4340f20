"""A made-up room for measuring speed: devices that are carried about between two Gen2 stations.

Gives the reports that they send by cable. Nothing is random.
"""

import math
import struct
from collections.abc import Iterator

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import (
    TICKS_PER_S,
    DeviceModel,
    Ints,
    StationCalibration,
)
from lobstr_hw.drivers.lighthouse.gen2 import PERIODS, THIRD
from lobstr_hw.drivers.lighthouse.inertial import GRAVITY, STANDARD_GRAVITY
from lobstr_hw.drivers.lighthouse.light import Station, Stations, look
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_rotation_vector, rotation_between

__all__ = ["made_device", "made_reports", "made_stations"]

SENSORS, RADIUS_M = 22, 0.05
IMU_HZ, ACC_G, GYRO_DEG_S = 250, 8.0, 2000.0
FIRST_TICK = 1_000_000
H = 1e-4
WORDS = 60
"""Bytes of words that fit into a report, a word with its marker having five."""


def made_device(name: str) -> DeviceModel:
    """A tracker with its sensors all over a ball."""
    i = np.arange(SENSORS) + 0.5
    z, turn = 1.0 - 2.0 * i / SENSORS, math.pi * (1.0 + math.sqrt(5.0)) * i
    level = np.sqrt(1.0 - z**2)
    normals = np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)
    one, none, here = np.ones(3), np.zeros(3), Pose.identity()
    return DeviceModel(
        name, "generic_tracker", "made up", RADIUS_M * normals, normals, np.arange(SENSORS),
        here, here, none, one, none, one,
    )  # fmt: skip


def made_stations() -> dict[int, Station]:
    """Two in opposite corners, looking at the middle of the room."""
    stations = {}
    for number, corner in enumerate((1.0, -1.0)):
        p = np.array([1.8 * corner, 2.2, 1.8 * corner])
        R = rotation_between(np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]) - p)
        stations[number] = Station(StationCalibration(2, 1 + number), Pose(R, p))
    return stations


def made_reports(seconds: float, nth: int) -> list[bytes]:
    """What the ``nth`` device sends in so many seconds, in the order in which it does."""
    parts = [*_imu_reports(seconds, nth), *_light_reports(made_stations(), seconds, nth)]
    return [data for _, data in sorted(parts, key=lambda part: part[0])]


def _pose(t: Array, nth: int) -> tuple[Array, Array]:
    """Place (n, 3) and rotation (n, 3, 3) at times (n,)."""
    phase = np.array([0.0, 1.0, 2.0]) + nth
    p = np.array([0.0, 1.0, 0.0]) + 0.3 * np.sin(np.outer(t, [0.9, 1.1, 1.3]) + phase)
    return p, from_rotation_vector(0.7 * np.sin(np.outer(t, [1.0, 0.8, 1.2]) + phase))


def _imu_reports(seconds: float, nth: int) -> Iterator[tuple[int, bytes]]:
    t = np.arange(int(seconds * IMU_HZ)) / IMU_HZ
    (before, R0), (p, R), (after, R1) = (_pose(t + dt, nth) for dt in (-H, 0.0, H))
    force = ((before - 2 * p + after) / H**2 - GRAVITY)[:, None] @ R / STANDARD_GRAVITY
    D = np.swapaxes(R0, 1, 2) @ R1
    rate = np.stack([D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]], 1)
    acc = np.rint(force[:, 0] / ACC_G * 32768).astype(int)
    gyro = np.rint(np.degrees(rate / (4 * H)) / GYRO_DEG_S * 32768).astype(int)
    ticks = FIRST_TICK + np.rint(t * TICKS_PER_S).astype(np.int64)
    slots = [
        struct.pack("<6hIB", *a, *g, tick & 0xFFFFFFFF, k & 0xFF)
        for k, (a, g, tick) in enumerate(
            zip(acc.tolist(), gyro.tolist(), ticks.tolist(), strict=True)
        )
    ]
    for k in range(2, len(slots)):
        yield int(ticks[k]), b"\x20" + b"".join(slots[k - 2 : k + 1])


def _light_reports(stations: Stations, seconds: float, nth: int) -> Iterator[tuple[int, bytes]]:
    """As soon as a report is full of words."""
    words = sorted(word for number in stations for word in _words(stations, number, seconds, nth))
    each = WORDS // 5
    for first in range(0, len(words), each):
        some = words[first : first + each]
        data = b"".join(word for _, word in some)
        yield some[-1][0], bytes([0x28, len(data)]) + data.ljust(62, b"\0")


def _words(
    stations: Stations, number: int, seconds: float, nth: int
) -> Iterator[tuple[int, bytes]]:
    """A station's syncs and sweeps, by the time of each."""
    period = PERIODS[number]
    turns = FIRST_TICK + np.arange(0, int(seconds * TICKS_PER_S) - period, period)
    for tick in turns.tolist():
        yield tick, _word(number, (tick & 0xFFFFFF) << 2)
    for plane in (0, 1):
        ticks, sensor = _hits(stations, number, plane, turns, nth)
        for tick, port in zip(ticks.tolist(), sensor.tolist(), strict=True):
            yield tick, _word(number, port << 27 | (tick & 0xFFFFFF) << 3 | 0b010)


def _hits(stations: Stations, number: int, plane: int, turns: Ints, nth: int) -> tuple[Ints, Ints]:
    """When a plane hits which sensor; when depends on where the device is then."""
    model = made_device("")
    sensor, start = np.tile(np.arange(SENSORS), len(turns)), np.repeat(turns, SENSORS)
    station, axis = np.full(len(start), number), np.full(len(start), plane)
    ticks = start + PERIODS[number] * (1 + plane) // 3
    for _ in range(3):
        p, R = _pose((ticks - FIRST_TICK) / TICKS_PER_S, nth)
        turned = R @ np.stack([model.points[sensor], model.normals[sensor]], axis=2)
        normal = turned[..., 1]
        angle, _, seen = look(stations, station, axis, p + turned[..., 0], normal)
        turn = (angle + THIRD * (1 + plane)) / (2 * math.pi)
        ticks = start + np.rint(turn * PERIODS[number]).astype(np.int64)
    facing = np.einsum("ij,ij->i", normal, stations[number].T_world_station.p - p) > 0.0
    return ticks[seen & facing], sensor[seen & facing]


def _word(channel: int, word: int) -> bytes:
    return bytes([channel << 4 | 1]) + struct.pack("<I", word)
