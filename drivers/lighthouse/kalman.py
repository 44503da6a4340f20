"""An error-state Kalman filter on position, velocity, rotation and the IMU's biases.

The nominal state follows the IMU (drivers/lighthouse/inertial.py); its error, 15 numbers, is

    0:3 position | 3:6 velocity | 6:9 rotation, in the IMU frame | 9:12 gyro bias | 12:15 acc bias

with ``R_true = R exp(error)`` (Sola, Quaternion kinematics for the error-state Kalman filter, 2017,
section 5 and 6). Light corrects it window by window: every hit at its own time, all of a window in
one update, in information form since a window has more hits than the state has numbers.
"""

import math
from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, DeviceModel
from lobstr_hw.drivers.lighthouse.inertial import STANDARD_GRAVITY, Track, cross, rotation_steps
from lobstr_hw.drivers.lighthouse.light import Flags, Stations, look
from lobstr_hw.drivers.lighthouse.refine import Refined
from lobstr_hw.rotations import Array

__all__ = [
    "FilterSettings",
    "FilterState",
    "LightReport",
    "advance",
    "correct_with_light",
    "correct_with_rest",
    "covariance",
    "start",
]

ERRORS = 15
POSITION, VELOCITY, ROTATION = slice(0, 3), slice(3, 6), slice(6, 9)
GYRO_BIAS, ACC_BIAS = slice(9, 12), slice(12, 15)
AXES = np.arange(3)
KEEP = np.r_[0:3, 6:9]
REST = np.r_[3:6, 9:12]
EYE, EYE9, EYE3 = np.eye(ERRORS), np.eye(9), np.eye(3)


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """How much the filter trusts what.

    Attributes:
        hit_sigma_rad: of one hit: timing noise is 0.05 to 0.1 mrad, the model's and the sensors'
            places add as much.
        gate_sigmas: hits further off than this are left out: reflections, mostly.
        acc_noise: m/s^2/sqrt(Hz). Ten times the chip's, for its scale and the mounting's play.
        gyro_noise: rad/s/sqrt(Hz). Likewise.
        acc_bias_walk: m/s^2 per sqrt(s).
        gyro_bias_walk: rad/s per sqrt(s).
        acc_bias_sigma: m/s^2 at the start: 0.02 g, as real devices are off (acc_bias in their
            configuration is of doubtful unit).
        gyro_bias_sigma: rad/s at the start.
        rest_speed_sigma: m/s: how still a device at rest is.
        rest_gyro_sigma: rad/s: how well a stretch of rest gives the gyro's bias.
        rest_calm: at rest, the accelerometer's noise is this much of acc_noise: nothing shakes it.
        between: what the IMU did between two samples is known no better than this share of how much
            the second differs from the first: it was shaken, or samples were lost on the way.
    """

    hit_sigma_rad: float = 2e-4
    gate_sigmas: float = 5.0
    acc_noise: float = 0.01
    gyro_noise: float = 5e-4
    acc_bias_walk: float = 2e-3
    gyro_bias_walk: float = 3e-3
    acc_bias_sigma: float = 0.2
    gyro_bias_sigma: float = 0.05
    rest_speed_sigma: float = 0.003
    rest_gyro_sigma: float = 0.003
    rest_calm: float = 0.1
    between: float = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class FilterState:
    """Where a device is at a moment, and how sure that is.

    Attributes:
        ticks: the moment.
        p, v: (3,) in the world.
        R: (3, 3) IMU frame to world.
        gyro_bias: (3,) rad/s.
        acc_bias: (3,) m/s^2.
        P: (15, 15) covariance of the error.
    """

    ticks: int
    p: Array
    v: Array
    R: Array
    gyro_bias: Array
    acc_bias: Array
    P: Array


@dataclass(frozen=True, slots=True)
class LightReport:
    """What became of a window's hits: how many there were, were believed, and their fit."""

    hits: int
    used: int
    rms_rad: float


def start(
    ticks: int, fit: Refined, acc_bias: Array, gyro_bias: Array, settings: FilterSettings
) -> FilterState:
    """A filter that begins at a fitted pose."""
    P = np.zeros((ERRORS, ERRORS))
    order = np.r_[0:3, 6:9, 3:6]  # the fit has rotation before velocity
    P[np.ix_(order, order)] = fit.covariance
    P[:9, :9] += np.diag([1e-6] * 3 + [1e-4] * 3 + [1e-6] * 3)
    P[GYRO_BIAS, GYRO_BIAS] = np.eye(3) * settings.gyro_bias_sigma**2
    P[ACC_BIAS, ACC_BIAS] = np.eye(3) * settings.acc_bias_sigma**2
    g = fit.guess
    return FilterState(ticks, g.p, g.v, g.R, gyro_bias, acc_bias, P)


def _transition(track: Track) -> Array:
    """How an error at the track's start shows at its end (15, 15)."""
    t, R = (track.ticks[-1] - track.ticks[0]) / TICKS_PER_S, track.R[0]
    # the mean specific force up to there, in the world
    x, y, z = (np.add.reduce(track.a, axis=0) / len(track.a)).tolist()
    y += STANDARD_GRAVITY
    tilt = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]) @ R
    F = EYE.copy()
    F[AXES, AXES + 3] = t
    F[POSITION, ROTATION], F[VELOCITY, ROTATION] = 0.5 * t**2 * tilt, t * tilt
    F[POSITION, ACC_BIAS], F[VELOCITY, ACC_BIAS] = -0.5 * t**2 * R, -t * R
    F[ROTATION, ROTATION] = track.R[-1].T @ R
    F[AXES + 6, AXES + 9] = -t
    return F


def _noise(track: Track, settings: FilterSettings, calm: float) -> Array:
    """Covariance (15, 15) gathered along a track."""
    dt = (track.ticks[1:] - track.ticks[:-1])[:, None] / TICKS_PER_S
    t = float(track.ticks[-1] - track.ticks[0]) / TICKS_PER_S
    acc, gyro = (settings.acc_noise * calm) ** 2, settings.gyro_noise**2
    sped, turned = _unseen(track.a, dt, settings.between), _unseen(track.gyro, dt, settings.between)
    Q = np.zeros((ERRORS, ERRORS))
    Q[AXES, AXES] = (acc * t / 3.0 + sped / 3.0) * t**2
    Q[AXES, AXES + 3] = Q[AXES + 3, AXES] = (acc * t + sped) * t / 2.0
    Q[AXES + 3, AXES + 3] = acc * t + sped
    Q[AXES + 6, AXES + 6] = gyro * t + turned
    Q[AXES + 9, AXES + 9] = settings.gyro_bias_walk**2 * t
    Q[AXES + 12, AXES + 12] = settings.acc_bias_walk**2 * t
    return Q


def _unseen(rate: Array, dt: Array, share: float) -> float:
    """Variance of the integral of a rate (n, 3) for what it did between its samples."""
    off = share * (rate[1:] - rate[:-1]) * dt
    return float(np.vdot(off, off)) / 3.0


def covariance(state: FilterState, track: Track, settings: FilterSettings, calm: float) -> Array:
    """Covariance (6, 6) of position and rotation at a track's end."""
    F = _transition(track)[KEEP]
    return np.asarray(F @ state.P @ F.T + _noise(track, settings, calm)[KEEP[:, None], KEEP])


def advance(
    state: FilterState, track: Track, settings: FilterSettings, calm: float = 1.0
) -> FilterState:
    """The state at a track's end, from the IMU alone."""
    F = _transition(track)
    P = F @ state.P @ F.T + _noise(track, settings, calm)
    end = int(track.ticks[-1])
    return FilterState(
        end, track.p[-1], track.v[-1], track.R[-1], state.gyro_bias, state.acc_bias, P
    )


def correct_with_light(
    state: FilterState,
    track: Track,
    angles: Angles,
    model: DeviceModel,
    stations: Stations,
    settings: FilterSettings,
) -> tuple[FilterState, LightReport]:
    """Correct the state at a track's end by the hits along it.

    Args:
        state: at the track's end, by :func:`advance`.
        track: the dead reckoning.
        angles: hits within the track's time, of known stations only.
        model: the device.
        stations: where they stand.
        settings: of the filter.
    """
    error, H, seen = _light_residuals(state, track, angles, model, stations)
    P9 = state.P[:9, :9]
    spread = np.add.reduce((H @ P9) * H, axis=1) + settings.hit_sigma_rad**2
    good = seen & (error * error < settings.gate_sigmas**2 * spread)
    used = int(np.count_nonzero(good))
    if used == 0:
        return state, LightReport(len(angles), 0, 0.0)
    H, e = H[good], error[good]
    rms = math.sqrt(float(e @ e) / used)
    weight = settings.hit_sigma_rad**-2
    A, b = weight * (H.T @ H), weight * (H.T @ e)
    # K = P H^T (H P H^T + V)^-1 = P[:, :9] (1 + A P9)^-1 H^T V^-1
    gain = state.P[:, :9] @ np.linalg.inv(EYE9 + A @ P9)
    P = state.P - gain @ A @ state.P[:9]
    return inject(state, gain @ b, P), LightReport(len(angles), used, rms)


def _light_residuals(
    state: FilterState, track: Track, angles: Angles, model: DeviceModel, stations: Stations
) -> tuple[Array, Array, Flags]:
    """Angles (m,) missed by, their derivative (m, 9) by the errors at the end, possible (m,)."""
    j = np.maximum(np.searchsorted(track.ticks, angles.ticks, side="right") - 1, 0)
    dt = ((angles.ticks - track.ticks[j]) / TICKS_PER_S)[:, None]
    back = ((angles.ticks - track.ticks[-1]) / TICKS_PER_S)[:, None]
    R = track.R[j] @ rotation_steps(track.gyro[j] * dt)
    p = track.p[j] + dt * (track.v[j] + 0.5 * dt * track.a[j])
    both = np.stack([model.points[angles.sensor], model.normals[angles.sensor]], axis=2)
    turned = R @ both  # (m, 3, 2)
    r = turned[..., 0]
    angle, slope, seen = look(stations, angles.station, angles.axis, p + r, turned[..., 1])
    H = np.empty((len(angle), 9))
    H[:, :3], H[:, 3:6], H[:, 6:] = slope, back * slope, cross(r, slope) @ state.R
    return angles.angle_rad - angle, H, seen


def correct_with_rest(
    state: FilterState, gyro_mean: Array, settings: FilterSettings
) -> FilterState:
    """Correct by lying still: no speed, and what the gyroscope says is its bias."""
    rows = state.P[REST]
    S = rows[:, REST]
    S[AXES, AXES] += settings.rest_speed_sigma**2
    S[AXES + 3, AXES + 3] += settings.rest_gyro_sigma**2
    gain = np.linalg.solve(S, rows).T
    e = np.concatenate([-state.v, gyro_mean - state.gyro_bias])
    return inject(state, gain @ e, state.P - gain @ rows)


def inject(state: FilterState, x: Array, P: Array) -> FilterState:
    """Move the nominal state by an error (15,), which is then none (Sola 2017, section 6.2)."""
    R = state.R @ rotation_steps(x[None, ROTATION])[0]
    # one Newton step keeps it a rotation through hours of products
    R = R @ (1.5 * EYE3 - 0.5 * (R.T @ R))
    return FilterState(
        state.ticks,
        state.p + x[POSITION],
        state.v + x[VELOCITY],
        R,
        state.gyro_bias + x[GYRO_BIAS],
        state.acc_bias + x[ACC_BIAS],
        0.5 * (P + P.T),
    )
