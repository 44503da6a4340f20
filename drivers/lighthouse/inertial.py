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
    "cross",
    "gather",
    "integrate",
    "reckon",
    "rotation_steps",
    "turns",
]

STANDARD_GRAVITY = 9.80665
EYE = np.eye(3)
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
    K = np.zeros((len(w), 3, 3))
    K[:, 2, 1], K[:, 0, 2], K[:, 1, 0] = w[:, 0], w[:, 1], w[:, 2]
    K[:, 1, 2], K[:, 2, 0], K[:, 0, 1] = -w[:, 0], -w[:, 1], -w[:, 2]
    square = np.add.reduce(w * w, axis=1)[:, None, None]
    # sin(a)/a and (1 - cos(a))/a^2 by their series: exact to 1e-9 at half a radian
    a = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
    b = 0.5 - square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0))
    return np.asarray(EYE + a * K + b * (K @ K))


def cross(a: Array, b: Array) -> Array:
    """Cross products of rows (n, 3); for few rows much quicker than numpy's."""
    out = np.empty_like(a)
    out[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    out[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    out[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return out


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
    R[0] = EYE
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
    return reckon(ImuSamples(ticks, acc, gyro), p, v, R, acc_bias, gyro_bias)


def reckon(
    imu: ImuSamples, p: Array, v: Array, R: Array, acc_bias: Array, gyro_bias: Array
) -> Track:
    """Dead reckoning through samples, from the first of them: as :func:`integrate`."""
    gyro = imu.gyro_rad_s - gyro_bias
    dt = (imu.ticks[1:] - imu.ticks[:-1]) / TICKS_PER_S
    Rs = R @ turns(gyro, dt)
    a = (Rs @ (imu.acc_g * STANDARD_GRAVITY - acc_bias)[..., None])[..., 0] + GRAVITY
    step = dt[:, None]
    # rows of sums: the first is where it starts
    vs, ps = np.empty_like(a), np.empty_like(a)
    vs[0], ps[0] = v, p
    vs[1:] = 0.5 * step * (a[:-1] + a[1:])
    np.add.accumulate(vs, axis=0, out=vs)
    ps[1:] = step * (vs[:-1] + step * (2.0 * a[:-1] + a[1:]) / 6.0)
    np.add.accumulate(ps, axis=0, out=ps)
    return Track(imu.ticks, ps, vs, a, Rs, gyro)


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
