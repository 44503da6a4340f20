"""Which way is up, from an IMU that was carried about and seen by light meanwhile.

Between two views of a device its IMU tells how it sped up, gravity included; the views tell how it
really moved. Gravity is the difference: linear equations in gravity, the views' velocities and the
accelerometer's bias (as in Qin et al. 2018, VINS-Mono, section V-B, with the scale known).
A device that lies still is the case in which nothing moves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, ImuSamples, Ints
from lobstr_hw.drivers.lighthouse.inertial import GRAVITY, STANDARD_GRAVITY, integrate
from lobstr_hw.drivers.lighthouse.light import Station
from lobstr_hw.drivers.lighthouse.refine import Guess
from lobstr_hw.drivers.lighthouse.station_views import Take, View
from lobstr_hw.rotations import Array, to_rotation_vector

__all__ = ["Upright", "measure_up"]

NEIGHBOURS_S = 1.0
"""Views further apart than this tell nothing: the IMU has drifted."""
POSITION_SIGMA_M, SPEED_SIGMA_M_S = 0.003, 0.02
"""What a view's position and an IMU over a quarter of a second are good for."""
BIAS_SIGMA_M_S2 = 0.2
STATION_UP_SIGMA_M_S2 = 0.2
"""A station's own accelerometer (OOTX) comes in steps of half a degree: good for about one."""


@dataclass(frozen=True, slots=True, eq=False)
class Upright:
    """What the IMU adds to the views.

    Attributes:
        up: (3,) direction, length 1.
        sigma_rad: how well it is known.
        v: (n, 3) velocity at each view; where it has no neighbour, what it was before.
    """

    up: Array
    sigma_rad: float
    v: Array


Step = tuple[int, int, Array, Array, Array, Array, float]


def measure_up(
    takes: Sequence[Take],
    views: Sequence[View],
    guesses: Sequence[Guess],
    stations: Mapping[int, Station],
) -> Upright:
    """The direction of up in the frame of the guesses, and how fast the device went.

    Args:
        takes: of the devices.
        views: by take and time.
        guesses: the device at each view.
        stations: with what they say of up themselves, if anything.
    """
    steps = _steps(takes, views, guesses)
    columns = 3 + 3 * len(takes) + 3 * len(views)
    rows, right = [], []
    for i, j, alpha, beta, A, B, dt in steps:
        bias, vi, vj = 3 + 3 * views[i].take, _velocity(takes, i), _velocity(takes, j)
        row = np.zeros((6, columns))
        row[:3, :3], row[3:, :3] = 0.5 * dt**2 * np.eye(3), -dt * np.eye(3)
        row[:3, bias : bias + 3], row[3:, bias : bias + 3] = -A, B
        row[:3, vi : vi + 3] = dt * np.eye(3)
        row[3:, vi : vi + 3], row[3:, vj : vj + 3] = -np.eye(3), np.eye(3)
        sigma = np.repeat([POSITION_SIGMA_M, SPEED_SIGMA_M_S], 3)
        rows.append(row / sigma[:, None])
        right.append(np.concatenate([guesses[j].p - guesses[i].p - alpha, beta]) / sigma)
    rows.append(np.eye(columns)[3 : 3 + 3 * len(takes)] / BIAS_SIGMA_M_S2)
    right.append(np.zeros(3 * len(takes)))
    for station in stations.values():
        if np.any(station.calibration.up):
            rows.append(np.eye(columns)[:3] / STATION_UP_SIGMA_M_S2)
            up = station.T_world_station.R @ station.calibration.up
            right.append(-STANDARD_GRAVITY * up / STATION_UP_SIGMA_M_S2)
    M = np.concatenate(rows)
    # velocities of views without a neighbour are free: a trace of a prior
    M = np.concatenate([M, 1e-3 * np.eye(columns)])
    found = np.linalg.lstsq(M, np.concatenate([*right, np.zeros(columns)]), rcond=None)[0]
    gravity, spread = found[:3], np.linalg.inv(M.T @ M)[:3, :3]
    up_sigma = float(np.sqrt(np.trace(spread)) / STANDARD_GRAVITY)
    joined = np.unique([k for step in steps for k in step[:2]]).astype(int)
    v = np.stack([g.v for g in guesses])
    v[joined] = found[3 + 3 * len(takes) :].reshape(-1, 3)[joined]
    return Upright(-gravity / max(float(np.linalg.norm(gravity)), 1e-9), up_sigma, v)


def _velocity(takes: Sequence[Take], view: int) -> int:
    return 3 + 3 * len(takes) + 3 * view


def _steps(takes: Sequence[Take], views: Sequence[View], guesses: Sequence[Guess]) -> list[Step]:
    """What the IMU says between neighbours: (i, j, moved, sped up, both by the bias, seconds)."""
    pairs = [
        (i, j)
        for i, j in pairwise(range(len(views)))
        if views[i].take == views[j].take
        and 0 < views[j].ticks - views[i].ticks < NEIGHBOURS_S * TICKS_PER_S
    ]
    biases = {k: _gyro_bias(takes[k], k, pairs, views, guesses) for k in range(len(takes))}
    return [_step(takes, views, guesses, i, j, biases[views[i].take]) for i, j in pairs]


def _between(take: Take, begin: int, end: int) -> tuple[ImuSamples, Ints]:
    i, j = np.searchsorted(take.imu.ticks, [begin, end])
    near = slice(max(int(i) - 1, 0), int(j) + 1)
    imu = take.imu.take(near)
    inside = imu.ticks[(imu.ticks > begin) & (imu.ticks < end)]
    return imu, np.concatenate([[begin], inside, [end]])


def _gyro_bias(
    take: Take,
    number: int,
    pairs: list[tuple[int, int]],
    views: Sequence[View],
    guesses: Sequence[Guess],
) -> Array:
    """What the gyroscope says too much, by how the views are turned to each other."""
    found = [np.zeros(3)]
    zero = np.zeros(3)
    for i, j in pairs:
        if views[i].take != number:
            continue
        imu, nodes = _between(take, views[i].ticks, views[j].ticks)
        said = integrate(imu, nodes, zero, zero, guesses[i].R, zero, zero).R[-1]
        dt = (views[j].ticks - views[i].ticks) / TICKS_PER_S
        found.append(to_rotation_vector(guesses[j].R.T @ said) / dt)
    return np.asarray(np.median(found[1:] or found, axis=0))


def _step(
    takes: Sequence[Take],
    views: Sequence[View],
    guesses: Sequence[Guess],
    i: int,
    j: int,
    gyro_bias: Array,
) -> Step:
    imu, nodes = _between(takes[views[i].take], views[i].ticks, views[j].ticks)
    zero = np.zeros(3)
    track = integrate(imu, nodes, zero, zero, guesses[i].R, zero, gyro_bias)
    dt = np.diff(nodes)[:, None, None] / TICKS_PER_S
    sped = np.concatenate(
        [np.zeros((1, 3, 3)), np.cumsum(0.5 * dt * (track.R[:-1] + track.R[1:]), 0)]
    )
    moved = np.sum(dt * sped[:-1] + dt**2 * (2.0 * track.R[:-1] + track.R[1:]) / 6.0, axis=0)
    seconds = (views[j].ticks - views[i].ticks) / TICKS_PER_S
    # dead reckoning takes gravity to lie along our -Y; here that is not known yet
    alpha = track.p[-1] - 0.5 * seconds**2 * GRAVITY
    beta = track.v[-1] - seconds * GRAVITY
    return i, j, alpha, beta, moved, sped[-1], seconds
