"""A pose for a device that has none: at the start, and after it was lost."""

from dataclasses import replace

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, DeviceModel
from lobstr_hw.drivers.lighthouse.inertial import gather
from lobstr_hw.drivers.lighthouse.kalman import start
from lobstr_hw.drivers.lighthouse.light import Hits, Stations, take_angles
from lobstr_hw.drivers.lighthouse.pose_seed import seed, seed_with_rotation
from lobstr_hw.drivers.lighthouse.refine import Guess, Refined, refine, residuals
from lobstr_hw.drivers.lighthouse.tracker_state import TrackerSettings, TrackerState

__all__ = ["reacquire", "second_look"]

CLEARLY_MORE = 0.25
"""So much more of the hits must agree with another pose: a mirror shows one that is as good."""


def reacquire(
    state: TrackerState,
    end: int,
    model: DeviceModel,
    stations: Stations,
    settings: TrackerSettings,
) -> TrackerState:
    """Look for the pose anew, in the hits up to a moment; nothing changes if there is none."""
    angles = _latest(state, end, settings)
    if angles is None:
        return state
    gyro_bias = np.zeros(3) if state.filter is None else state.filter.gyro_bias
    hits = gather(model, angles, state.imu, end, gyro_bias)
    fit = _by_rotation(state, stations, hits, end, settings)
    # dear, hence seldom: a device that is not seen enough would stall the others
    if fit is None and end - state.looked >= settings.search_s * TICKS_PER_S:
        state = replace(state, looked=end)
        fit = _from_nothing(state, stations, hits, settings)
    if fit is None:
        return state
    begun = _begin_at(state, fit, angles, end, model, stations, settings)
    return replace(begun, on_trial=True, disagreed=0, seen=0.0, believed=0.0)


def second_look(
    state: TrackerState,
    end: int,
    model: DeviceModel,
    stations: Stations,
    settings: TrackerSettings,
) -> TrackerState:
    """Go on from a pose that clearly more of the latest hits agree with, if there is one."""
    angles, f = _latest(state, end, settings), state.filter
    state = replace(state, looked=end)
    if angles is None or f is None:
        return state
    hits = gather(model, angles, state.imu, end, f.gyro_bias, f.R)
    fit = seed_with_rotation(stations, hits, f.R)
    if fit is None or not _is_good(stations, hits, fit, settings):
        return state
    share = [
        np.mean(np.abs(residuals(stations, hits, guess)[0]) < settings.seed_rms_rad)
        for guess in (Guess(f.R, f.p, f.v), fit.guess)
    ]
    if share[1] < share[0] + CLEARLY_MORE:
        return state
    begun = _begin_at(state, fit, angles, end, model, stations, settings)
    return replace(begun, disagreed=0, seen=0.0, believed=0.0)


def _latest(state: TrackerState, end: int, settings: TrackerSettings) -> Angles | None:
    """The hits that a new pose is made from, or None: too few, or the IMU does not cover them."""
    since = end - int(settings.seed_s * TICKS_PER_S)
    i, j = np.searchsorted(state.angles.ticks, [since, end], side="right")
    angles = take_angles(state.angles, slice(int(i), int(j)))
    if j - i < 8 or angles.ticks[-1] - angles.ticks[0] < settings.seed_span_s * TICKS_PER_S:
        return None
    if not len(state.imu) or state.imu.ticks[0] > since + settings.window:
        return None
    return angles


def _begin_at(
    state: TrackerState,
    fit: Refined,
    angles: Angles,
    end: int,
    model: DeviceModel,
    stations: Stations,
    settings: TrackerSettings,
) -> TrackerState:
    """A filter that begins at a fit, improved once more."""
    f = state.filter
    gyro_bias = np.zeros(3) if f is None else f.gyro_bias
    # again, now that it is known which way it fell meanwhile
    hits = gather(model, angles, state.imu, end, gyro_bias, fit.guess.R)
    true = np.abs(residuals(stations, hits, fit.guess)[0]) < settings.seed_outlier_rad
    fit = refine(stations, hits.select(true), fit.guess, 10)
    acc_bias = np.zeros(3) if f is None else f.acc_bias
    fresh = start(end, fit, acc_bias, gyro_bias, settings.filter)
    if f is not None:
        fresh.P[9:, 9:] = f.P[9:, 9:]  # the biases outlive an occlusion
    return replace(state, filter=fresh, light=int(angles.ticks[-1]), rms_rad=fit.rms_rad)


def _by_rotation(
    state: TrackerState, stations: Stations, hits: Hits, end: int, settings: TrackerSettings
) -> Refined | None:
    """A pose good enough to start from, by the rotation that the gyroscope has kept."""
    f = state.filter
    if f is None or end - state.light >= settings.rotation_known_s * TICKS_PER_S:
        return None
    fit = seed_with_rotation(stations, hits, f.R)
    return fit if fit is not None and _is_good(stations, hits, fit, settings) else None


def _from_nothing(
    state: TrackerState, stations: Stations, hits: Hits, settings: TrackerSettings
) -> Refined | None:
    """A pose good enough to start from, any rotation being possible."""
    up = state.imu.acc_g[-8:].mean(axis=0)
    fit = seed(stations, hits, up / max(float(np.linalg.norm(up)), 1e-9))
    return fit if fit is not None and _is_good(stations, hits, fit, settings) else None


def _is_good(stations: Stations, hits: Hits, fit: Refined, settings: TrackerSettings) -> bool:
    error = np.abs(residuals(stations, hits, fit.guess)[0])
    sigma = float(np.sqrt(np.trace(fit.covariance[:3, :3])))
    fits = float(np.mean(error < settings.seed_outlier_rad)) > 0.6
    return sigma < settings.seed_sigma_m and fit.rms_rad < settings.seed_rms_rad and fits
