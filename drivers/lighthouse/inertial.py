"""What the IMU says between two moments: turned, sped up, moved."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, DeviceModel, ImuSamples, Ints
from lobstr_hw.drivers.lighthouse.light import Hits
from lobstr_hw.rotations import Array

__all__ = [
    "GRAVITY",
    "STANDARD_GRAVITY",
    "Track",
    "at_ticks",
    "gather",
    "integrate",
    "rotation_steps",
    "turns",
]

STANDARD_GRAVITY = 9.80665
GRAVITY = np.array([0.0, -STANDARD_GRAVITY, 0.0])
"""In our world, Y up (docs/conventions.md)."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A stretch of dead reckoning at n moments, the first the one it starts from.

    Attributes:
        ticks: (n,).
        p, v, a: (n, 3) metres, metres per second, metres per second squared, in the world.
        R: (n, 3, 3).
        gyro: (n, 3) rad/s in the IMU frame, bias taken off.
    """

    ticks: Ints
    p: Array
    v: Array
    a: Array
    R: Array
    gyro: Array


def rotation_steps(w: Array) -> Array:
    """Rotation vectors (n, 3) -> matrices; the short way, for turns under a radian."""
    x, y, z = w.T
    square = np.einsum("ij,ij->i", w, w)
    # sin(a)/a and (1 - cos(a))/a^2 by their series: exact to 1e-9 at half a radian
    a = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
    b = 0.5 - square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0))
    R = np.empty((len(w), 3, 3))
    R[:, 0, 0], R[:, 1, 1], R[:, 2, 2] = (1.0 - b * (square - s * s) for s in (x, y, z))
    R[:, 0, 1], R[:, 1, 0] = b * x * y - a * z, b * x * y + a * z
    R[:, 0, 2], R[:, 2, 0] = b * x * z + a * y, b * x * z - a * y
    R[:, 1, 2], R[:, 2, 1] = b * y * z - a * x, b * y * z + a * x
    return R


def at_ticks(imu: ImuSamples, ticks: Ints) -> tuple[Array, Array]:
    """Specific force (n, 3) in g and angular velocity (n, 3) at moments, between the samples."""
    after = np.clip(np.searchsorted(imu.ticks, ticks), 1, max(len(imu) - 1, 1))
    if len(imu) == 1:
        return imu.acc_g[[0] * len(ticks)], imu.gyro_rad_s[[0] * len(ticks)]
    span = np.maximum(imu.ticks[after] - imu.ticks[after - 1], 1)
    f = np.clip((ticks - imu.ticks[after - 1]) / span, 0.0, 1.0)[:, None]
    acc = imu.acc_g[after - 1] * (1.0 - f) + imu.acc_g[after] * f
    gyro = imu.gyro_rad_s[after - 1] * (1.0 - f) + imu.gyro_rad_s[after] * f
    return acc, gyro


def turns(gyro: Array, dt: Array) -> Array:
    """Rotation (n, 3, 3) of each moment in the first, from angular velocity (n, 3) at them."""
    steps = rotation_steps(0.5 * (gyro[:-1] + gyro[1:]) * dt[:, None])
    R = np.empty((len(gyro), 3, 3))
    R[0] = np.eye(3)
    for i, step in enumerate(steps):
        np.matmul(R[i], step, out=R[i + 1])
    return R


def integrate(
    imu: ImuSamples, ticks: Ints, p: Array, v: Array, R: Array, acc_bias: Array, gyro_bias: Array
) -> Track:
    """Dead reckoning from the first of the moments through all of them (trapezoids).

    Args:
        imu: samples around the moments.
        ticks: (n,) rising; every sample between the first and the last should be among them.
        p: (3,) metres, at the first.
        v: (3,) metres per second.
        R: (3, 3) IMU frame to world.
        acc_bias: (3,) metres per second squared.
        gyro_bias: (3,) rad/s.
    """
    acc, gyro = at_ticks(imu, ticks)
    gyro = gyro - gyro_bias
    dt = np.diff(ticks) / TICKS_PER_S
    Rs = R @ turns(gyro, dt)
    a = np.einsum("nij,nj->ni", Rs, acc * STANDARD_GRAVITY - acc_bias) + GRAVITY
    step = dt[:, None]
    vs = np.concatenate([v[None], v + np.cumsum(0.5 * step * (a[:-1] + a[1:]), axis=0)])
    moved = step * vs[:-1] + step**2 * (2.0 * a[:-1] + a[1:]) / 6.0
    return Track(ticks, np.concatenate([p[None], p + np.cumsum(moved, axis=0)]), vs, a, Rs, gyro)


def gather(
    model: DeviceModel,
    angles: Angles,
    imu: ImuSamples,
    moment: int,
    gyro_bias: Array,
    R: Array | None = None,
) -> Hits:
    """Hits around a moment, turned to it by the gyroscope.

    Args:
        model: the device.
        angles: by time, some tens of milliseconds around the moment.
        imu: covering them.
        moment: ticks.
        gyro_bias: (3,) rad/s.
        R: the device's rotation in a world with Y up at the moment, when it is roughly known. Then
            the points are moved as it sped up and fell, too: 2 mm in 20 ms.
    """
    nodes = np.unique(np.concatenate([angles.ticks, [moment]]))
    between = imu.ticks[(imu.ticks > nodes[0]) & (imu.ticks < nodes[-1])]
    nodes = np.unique(np.concatenate([nodes, between]))
    _, gyro = at_ticks(imu, nodes)
    turn = turns(gyro - gyro_bias, np.diff(nodes) / TICKS_PER_S)
    now, hit = int(np.searchsorted(nodes, moment)), np.searchsorted(nodes, angles.ticks)
    turn = turn[now].T @ turn
    points = np.einsum("mij,mj->mi", turn[hit], model.points[angles.sensor])
    if R is not None:
        zero = np.zeros(3)
        track = integrate(imu, nodes, zero, zero, R @ turn[0], zero, gyro_bias)
        after = (nodes - moment)[:, None] / TICKS_PER_S
        points = points + ((track.p - track.p[now] - after * track.v[now]) @ R)[hit]
    turn = turn[hit]
    return Hits(
        points,
        np.einsum("mij,mj->mi", turn, model.normals[angles.sensor]),
        (angles.ticks - moment) / TICKS_PER_S,
        angles.station,
        angles.axis,
        angles.sensor,
        angles.angle_rad,
    )
