"""A made-up room: base stations, a device that moves as told, and what it measures of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import (
    TICKS_PER_S,
    Angles,
    DeviceModel,
    ImuSamples,
    Ints,
    StationCalibration,
)
from lobstr_hw.drivers.lighthouse.inertial import GRAVITY, STANDARD_GRAVITY
from lobstr_hw.drivers.lighthouse.light import Station, join_angles, look, take_angles
from lobstr_hw.drivers.lighthouse.tracker import (
    PoseBatch,
    TrackerSettings,
    begin,
    join_poses,
    step,
)
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_rotation_vector, rotation_between, rotation_y

Place = Callable[[Array], Array]

TURN_TICKS = {1: 800_000, 2: 959_000}


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A movement: place (n, 3) and rotation vector (n, 3) at times (n,) in seconds."""

    place: Place
    turn: Place

    def R(self, t: Array) -> Array:
        return from_rotation_vector(self.turn(np.asarray(t, dtype=np.float64)))

    def p(self, t: Array) -> Array:
        return np.asarray(self.place(np.asarray(t, dtype=np.float64)))


def carried(seed: int, speed: float = 1.0) -> Motion:
    """A device that is carried about and turned, smoothly."""
    random = np.random.default_rng(seed)
    phase, pitch = random.uniform(0, 6.28, (2, 3)), random.uniform(0.7, 1.3, (2, 3)) * speed

    def place(t: Array) -> Array:
        wave = np.sin(np.outer(t, pitch[0]) + phase[0])
        return np.asarray(np.array([0.5, 0.3, 0.5]) * wave + np.array([0.0, 1.0, 0.0]))

    def turn(t: Array) -> Array:
        return np.asarray(np.array([0.9, 0.8, 0.7]) * np.sin(np.outer(t, pitch[1]) + phase[1]))

    return Motion(place, turn)


def still(p: Array, turn: Array) -> Motion:
    """A device that lies where it lies."""
    return Motion(
        lambda t: np.broadcast_to(p, (len(t), 3)), lambda t: np.broadcast_to(turn, (len(t), 3))
    )


def device(seed: int = 0, sensors: int = 22, flat: bool = False) -> DeviceModel:
    """A device with sensors over a ball of 5 cm radius, or over a disc, all looking one way."""
    random = np.random.default_rng(seed)
    normals = random.normal(size=(sensors, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = 0.05 * normals + random.normal(scale=0.004, size=(sensors, 3))
    if flat:
        points = np.concatenate(
            [random.uniform(-0.06, 0.06, (sensors, 2)), np.zeros((sensors, 1))], 1
        )
        normals = np.broadcast_to([0.0, 0.0, 1.0], (sensors, 3))
    one, zero = np.ones(3), np.zeros(3)
    here = Pose.identity()
    return DeviceModel(
        "LHR-00000001", "generic_tracker", "made up", points, np.array(normals),
        np.arange(sensors), here, here, zero, one, zero, one,
    )  # fmt: skip


def room(generation: int, seed: int = 0, count: int = 2) -> dict[int, Station]:
    """Stations in the corners of a room, 2 m up, looking at its middle, factory-made."""
    random = np.random.default_rng(seed)
    stations = {}
    for number in range(count):
        p = rotation_y(np.pi / 4 + number * np.pi * (0.5 if count > 2 else 1.0)) @ [0.0, 2.1, -2.5]
        R = rotation_between(np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]) - p)
        calibration = StationCalibration(
            generation,
            1000 + number,
            phase=random.uniform(-0.05, 0.05, 2),
            tilt=random.uniform(-0.002, 0.002, 2),
            curve=random.uniform(-0.003, 0.003, 2),
            gibphase=random.uniform(-3.0, 3.0, 2),
            gibmag=random.uniform(-0.008, 0.008, 2),
        )
        stations[number] = Station(calibration, Pose(R, p))
    return stations


def imu_of(
    motion: Motion,
    seconds: float,
    rate_hz: float = 250.0,
    noise: float = 0.0,
    gyro_bias: float = 0.0,
    seed: int = 0,
    first_tick: int = 1_000_000,
) -> ImuSamples:
    """What the IMU says: exact, or with noise (1 = that of a real one)."""
    random, h = np.random.default_rng(seed), 1e-4
    ticks = first_tick + (np.arange(int(seconds * rate_hz)) * TICKS_PER_S / rate_hz).astype(
        np.int64
    )
    t = (ticks - first_tick) / TICKS_PER_S
    a = (motion.p(t + h) - 2.0 * motion.p(t) + motion.p(t - h)) / h**2
    R = motion.R(t)
    force = np.einsum("nji,nj->ni", R, a - GRAVITY) / STANDARD_GRAVITY
    D = np.swapaxes(motion.R(t - h), 1, 2) @ motion.R(t + h)
    rate = np.stack([D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]], 1)
    gyro = rate / (4.0 * h) + gyro_bias
    return ImuSamples(
        ticks,
        force + random.normal(scale=0.002 * noise, size=force.shape) if noise else force,
        gyro + random.normal(scale=0.002 * noise, size=gyro.shape) if noise else gyro,
    )


def turn_starts(generation: int, number: int, period: int, seconds: float) -> Ints:
    """Ticks after the beginning at which those turns of a station begin in which it sweeps."""
    starts = np.arange(0, int(seconds * TICKS_PER_S) - period, period)
    return np.asarray(starts + number * (TURN_TICKS[1] if generation == 1 else 311_000))


def light_of(
    stations: dict[int, Station],
    model: DeviceModel,
    motion: Motion,
    seconds: float,
    noise_rad: float = 0.0,
    seed: int = 0,
    first_tick: int = 1_000_000,
    turns: Sequence[int] | None = None,
) -> Angles:
    """Every hit of every sensor that looks at a station.

    ``turns``: how long those of Gen2 stations last, by number, so that angles and times agree.
    """
    random = np.random.default_rng(seed)
    parts = []
    for number, station in stations.items():
        generation = station.calibration.generation
        turn = turns[number] if turns else TURN_TICKS[generation]
        period = turn * (len(stations) if generation == 1 else 1)
        period += 0 if generation == 1 or turns else -7_000 * number
        starts = turn_starts(generation, number, period, seconds)
        for axis in (0, 1):
            parts.append(_sweeps(station, number, axis, starts, model, motion, first_tick, turn))
    angles = join_angles([p for p in parts if len(p)])
    noisy = angles.angle_rad + random.normal(scale=noise_rad, size=len(angles))
    inside = angles.ticks < first_tick + int(seconds * TICKS_PER_S)
    return Angles(
        angles.ticks[inside], angles.station[inside], angles.axis[inside],
        angles.sensor[inside], noisy[inside],
    )  # fmt: skip


def _sweeps(
    station: Station,
    number: int,
    axis: int,
    starts: Ints,
    model: DeviceModel,
    motion: Motion,
    first_tick: int,
    turn: int,
) -> Angles:
    n, s = len(starts), len(model.points)
    sensor = np.tile(np.arange(s), n)
    start = np.repeat(starts, s)
    ticks = start + 200_000
    where = np.full(n * s, number)
    for _ in range(3):  # the moment of the hit depends on where the device is then
        t = ticks / TICKS_PER_S
        R = motion.R(t)
        at = motion.p(t) + np.einsum("mij,mj->mi", R, model.points[sensor])
        normal = np.einsum("mij,mj->mi", R, model.normals[sensor])
        angle, _, _ = look({number: station}, where, np.full(n * s, axis), at, normal)
        ticks = start + _delay(station.calibration.generation, axis, angle, turn)
    toward = station.T_world_station.p - at
    ahead = np.einsum("mi,i->m", -toward, -station.T_world_station.R[:, 2])
    seen = (np.einsum("mi,mi->m", normal, toward) > 0.0) & (ahead > 0.3)
    keep = np.flatnonzero(seen)
    return Angles(
        first_tick + ticks[keep], where[keep], np.full(len(keep), axis), sensor[keep], angle[keep]
    )


def _delay(generation: int, axis: int, angle: Array, turn: int) -> Ints:
    if generation == 1:
        ticks = axis * 400_000 + (angle + np.pi / 2.0) * 400_000 / np.pi
    else:
        ticks = (angle + (axis + 1) * 2.0 * np.pi / 3.0) * turn / (2.0 * np.pi)
    return np.asarray(ticks).astype(np.int64)


def track(
    model: DeviceModel,
    stations: dict[int, Station],
    imu: ImuSamples,
    angles: Angles,
    chunk_ticks: int = 528_000,
    settings: TrackerSettings | None = None,
) -> PoseBatch:
    """All poses, fed in pieces as a driver would."""
    settings = settings or TrackerSettings()
    state, given = begin(), []
    for since in range(int(imu.ticks[0]), int(imu.ticks[-1]) + chunk_ticks, chunk_ticks):
        i, j = np.searchsorted(imu.ticks, [since, since + chunk_ticks])
        k, n = np.searchsorted(angles.ticks, [since, since + chunk_ticks])
        part = imu.take(slice(i, j))
        light = take_angles(angles, slice(int(k), int(n)))
        state, batch = step(state, model, stations, part, light, settings)
        given.append(batch)
    return join_poses(given)
