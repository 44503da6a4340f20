"""From one device's angles and IMU samples to poses, one for every IMU sample.

State in, state out. All steps are taken at fixed places of the device's own time: light is used in
windows of 8 ms, each once the IMU has come 10 ms further (a sweep is known only at its end, and
light and IMU come by different ways). So poses do not depend on when a packet arrived.

    windows of light   |----E-8ms----|----E----|----E+8ms----|
    IMU sample at t    its pose: the state at E, dead reckoned to t, for E + 10 ms < t <= E + 18 ms
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, DeviceModel, ImuSamples, Ints
from lobstr_hw.drivers.lighthouse.inertial import Track, gather, integrate
from lobstr_hw.drivers.lighthouse.kalman import (
    FilterSettings,
    FilterState,
    advance,
    correct_with_light,
    correct_with_rest,
    covariances,
    start,
)
from lobstr_hw.drivers.lighthouse.light import Hits, Stations, join_angles, take_angles
from lobstr_hw.drivers.lighthouse.pose_seed import seed, seed_with_rotation
from lobstr_hw.drivers.lighthouse.refine import Refined, refine, residuals
from lobstr_hw.rotations import Array

__all__ = ["Fix", "PoseBatch", "TrackerSettings", "TrackerState", "begin", "join_poses", "step"]


class Fix(IntEnum):
    """How a pose came about."""

    LIGHT = 0
    """By light within the last 50 ms, and the IMU."""
    INERTIAL = 1
    """By the IMU alone, for up to 100 ms."""
    LOST = 2
    """Only the rotation is still followed; the position is where it was."""


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """Times and limits of tracking.

    Attributes:
        window: ticks of light that are used together: about one sweep.
        lag: ticks that light may come later than the IMU.
        inertial_s: without light for so long: dead reckoning, said so.
        lost_s: without light for so long: lost. Dead reckoning drifts 5 cm in 0.3 s.
        seed_s: hits of the last so many seconds make a new pose: two turns of the rotors.
        seed_span_s: they must cover so much: velocity is told by time.
        seed_rms_rad: a new pose must fit so well.
        seed_outlier_rad: hits further from a new pose than this are reflections.
        seed_sigma_m: and be known so well.
        search_windows: a pose from nothing, some 40 ms of work, is looked for so seldom.
        rotation_known_s: after so long without light the gyroscope's rotation is forgotten.
        lost_sigma_m: a position less certain than this is none.
        disagree_windows: so many windows in a row whose light does not fit: the pose is wrong.
        rest_s: so long without movement is rest.
        rest_gyro_rad_s, rest_acc_g: spread of the IMU's samples at rest, at most.
        rest_speed_m_s: a device that light sees moving is not at rest, however calm its IMU.
        filter: of the Kalman filter.
    """

    window: int = 8 * TICKS_PER_S // 1000
    lag: int = 10 * TICKS_PER_S // 1000
    inertial_s: float = 0.05
    lost_s: float = 0.1
    seed_s: float = 0.036
    seed_span_s: float = 0.02
    seed_rms_rad: float = 1e-3
    seed_outlier_rad: float = 3e-3
    seed_sigma_m: float = 0.03
    search_windows: int = 16
    rotation_known_s: float = 5.0
    lost_sigma_m: float = 0.1
    disagree_windows: int = 8
    rest_s: float = 0.25
    rest_gyro_rad_s: float = 0.012
    rest_acc_g: float = 0.012
    rest_speed_m_s: float = 0.03
    filter: FilterSettings = field(default_factory=FilterSettings)


@dataclass(frozen=True, slots=True, eq=False)
class PoseBatch:
    """Poses of the IMU frame in the world, one for each IMU sample (k of them).

    Attributes:
        ticks: (k,) device ticks.
        p, v: (k, 3). The velocity is zero while the device lies still.
        R: (k, 3, 3).
        angular_velocity: (k, 3) in the IMU frame, bias taken off.
        covariance: (k, 6, 6) of the position, in the world, and the rotation, in the IMU frame.
        fix: (k,) of Fix.
    """

    ticks: Ints
    p: Array
    v: Array
    R: Array
    angular_velocity: Array
    covariance: Array
    fix: NDArray[np.int8]

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.ticks)


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """All that tracking one device remembers.

    Attributes:
        filter: at the end of the last window, or None before the first pose.
        imu: samples still needed: the last rest_s, and all after the filter's moment.
        angles: hits still needed, by time.
        window_end: ticks; windows up to here are done.
        given: ticks of the last pose given.
        light: ticks of the last hit that was believed.
        lost: the position is not followed.
        still: at rest.
        disagreed: windows in a row whose light did not fit.
        rms_rad: of the hits believed last.
    """

    filter: FilterState | None
    imu: ImuSamples
    angles: Angles
    window_end: int
    given: int
    light: int
    lost: bool
    still: bool
    disagreed: int
    rms_rad: float


def _no_imu() -> ImuSamples:
    return ImuSamples(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)))


def _no_angles() -> Angles:
    none = np.zeros(0, np.int64)
    return Angles(none, none, none, none, np.zeros(0))


def begin() -> TrackerState:
    """Nothing known yet."""
    never = -(2**62)
    return TrackerState(None, _no_imu(), _no_angles(), never, never, never, True, False, 0, 0.0)


def step(
    state: TrackerState,
    model: DeviceModel,
    stations: Stations,
    imu: ImuSamples,
    angles: Angles,
    settings: TrackerSettings,
) -> tuple[TrackerState, PoseBatch]:
    """Take in what came from a device and give the poses of its new IMU samples.

    Args:
        state: from the last call, or :func:`begin`.
        model: the device.
        stations: those whose place is known; hits of others are left out.
        imu: new samples, oldest first.
        angles: new hits, in any order.
        settings: of the tracking.

    Returns:
        The new state, and a pose for every new IMU sample since the first pose was found.
    """
    state = _take_in(state, stations, imu, angles, settings)
    given: list[PoseBatch] = []
    if not len(state.imu):
        return state, join_poses(given)
    newest = int(state.imu.ticks[-1])
    while newest >= state.window_end + settings.window + settings.lag:
        state, batch = _give(state, state.window_end + settings.window + settings.lag, settings)
        given.append(batch)
        state = _window(state, model, stations, settings)
    state, batch = _give(state, newest, settings)
    return state, join_poses([*given, batch])


def _take_in(
    state: TrackerState,
    stations: Stations,
    imu: ImuSamples,
    angles: Angles,
    settings: TrackerSettings,
) -> TrackerState:
    if len(angles):
        known = np.isin(angles.station, np.array(sorted(stations), dtype=np.int64))
        in_time = angles.ticks > state.window_end
        state = replace(
            state, angles=join_angles([state.angles, take_angles(angles, known & in_time)])
        )
    if not len(imu):
        return state
    later = imu.ticks > (state.imu.ticks[-1] if len(state.imu) else -(2**62))
    joined = ImuSamples(
        np.concatenate([state.imu.ticks, imu.ticks[later]]),
        np.concatenate([state.imu.acc_g, imu.acc_g[later]]),
        np.concatenate([state.imu.gyro_rad_s, imu.gyro_rad_s[later]]),
    )
    first, newest = int(joined.ticks[0]), int(joined.ticks[-1])
    # windows lie at multiples of their length, wherever a recording begins
    begun = max(state.window_end, first // settings.window * settings.window)
    if newest - begun > 2 * TICKS_PER_S and len(state.imu) and later.any():
        begun = _after_gap(joined, begun, settings)
    return replace(state, imu=joined, window_end=begun)


def _after_gap(imu: ImuSamples, begun: int, settings: TrackerSettings) -> int:
    """Where to go on when the IMU was silent for over a second; else where we are."""
    gaps = np.flatnonzero(np.diff(imu.ticks) > TICKS_PER_S)
    if not len(gaps):
        return begun
    return max(begun, int(imu.ticks[gaps[-1] + 1]) // settings.window * settings.window)


def _nodes(imu: ImuSamples, begin_at: int, end: int, after: int) -> tuple[Ints, int]:
    """Moments: the start, every sample in (start, end]; how many of them are up to ``after``."""
    i, j = np.searchsorted(imu.ticks, [begin_at, end], side="right")
    nodes = np.concatenate([[begin_at], imu.ticks[i:j]])
    return nodes, int(np.searchsorted(nodes, after, side="right"))


def _reckon(state: TrackerState, filter_state: FilterState, nodes: Ints) -> Track:
    f = filter_state
    near = slice(
        max(int(np.searchsorted(state.imu.ticks, nodes[0])) - 1, 0),
        int(np.searchsorted(state.imu.ticks, nodes[-1], side="right")) + 1,
    )
    imu = ImuSamples(state.imu.ticks[near], state.imu.acc_g[near], state.imu.gyro_rad_s[near])
    return integrate(imu, nodes, f.p, f.v, f.R, f.acc_bias, f.gyro_bias)


def _give(
    state: TrackerState, until: int, settings: TrackerSettings
) -> tuple[TrackerState, PoseBatch]:
    """The poses of samples not given yet, up to a moment."""
    f = state.filter
    if f is None:
        return replace(state, given=max(state.given, until)), join_poses([])
    nodes, skip = _nodes(state.imu, f.ticks, until, max(state.given, f.ticks))
    if skip >= len(nodes):
        return state, join_poses([])
    track = _reckon(state, f, nodes)
    k = len(nodes) - skip
    p, v, fix = track.p[skip:], track.v[skip:], np.full(k, Fix.LIGHT, dtype=np.int8)
    dark_s = (nodes[skip:] - state.light) / TICKS_PER_S
    fix[dark_s > settings.inertial_s] = Fix.INERTIAL
    lost = np.flatnonzero((dark_s > settings.lost_s) | state.lost)
    if state.still:
        v = np.zeros((k, 3))
        p = np.broadcast_to(f.p, (k, 3))
    if len(lost):
        fix[lost] = Fix.LOST
        p, v = p.copy(), v.copy()
        p[lost], v[lost] = (f.p if state.lost or lost[0] == 0 else p[lost[0] - 1]), 0.0
    P = covariances(f, track, settings.filter, settings.filter.rest_calm if state.still else 1.0)
    batch = PoseBatch(nodes[skip:], p, v, track.R[skip:], track.gyro[skip:], P[skip:], fix)
    return replace(state, given=int(nodes[-1])), batch


def _window(
    state: TrackerState, model: DeviceModel, stations: Stations, settings: TrackerSettings
) -> TrackerState:
    """Use the next window of light."""
    end = state.window_end + settings.window
    state = replace(state, window_end=end, still=_is_still(state, end, settings))
    if state.filter is not None:
        state = _filter_window(state, state.filter, end, model, stations, settings)
    if state.lost:
        state = _find(state, end, model, stations, settings)
    return _forget(state, end, settings)


def _filter_window(
    state: TrackerState,
    f: FilterState,
    end: int,
    model: DeviceModel,
    stations: Stations,
    settings: TrackerSettings,
) -> TrackerState:
    nodes, _ = _nodes(state.imu, f.ticks, end, end)
    if nodes[-1] != end:
        nodes = np.append(nodes, end)
    track = _reckon(state, f, nodes)
    if state.lost:
        return replace(state, filter=_turn_only(f, track))
    calm = settings.filter.rest_calm if state.still else 1.0
    now = advance(f, track, settings.filter, calm)
    i, j = np.searchsorted(state.angles.ticks, [f.ticks, end], side="right")
    if j > i:
        window = take_angles(state.angles, slice(int(i), int(j)))
        now, report = correct_with_light(now, track, window, model, stations, settings.filter)
        fits = 2 * report.used >= report.hits
        state = replace(state, disagreed=0 if fits else state.disagreed + 1)
        if report.used >= 2 and fits:
            state = replace(state, light=int(window.ticks[-1]), rms_rad=report.rms_rad)
    if state.still:
        now = correct_with_rest(now, _rest_gyro(state, end, settings), settings.filter)
    return _judge(replace(state, filter=now), f, now, end, settings)


def _judge(
    state: TrackerState, before: FilterState, now: FilterState, end: int, settings: TrackerSettings
) -> TrackerState:
    """Lost when too long without light, too unsure, or light keeps disagreeing."""
    dark = end - state.light > settings.lost_s * TICKS_PER_S
    unsure = np.trace(now.P[:3, :3]) > settings.lost_sigma_m**2
    if not (dark or unsure or state.disagreed >= settings.disagree_windows):
        return state
    return replace(
        state,
        lost=True,
        disagreed=0,
        filter=replace(now, p=before.p, v=np.zeros(3)),
    )


def _turn_only(f: FilterState, track: Track) -> FilterState:
    """Follow the rotation, leave the position."""
    P = f.P.copy()
    P[:3, :3] += np.eye(3) * 0.01**2  # a centimetre more each window: nobody shall trust it
    return replace(f, ticks=int(track.ticks[-1]), R=track.R[-1], v=np.zeros(3), P=P)


def _find(
    state: TrackerState,
    end: int,
    model: DeviceModel,
    stations: Stations,
    settings: TrackerSettings,
) -> TrackerState:
    """Look for the pose anew."""
    since = end - int(settings.seed_s * TICKS_PER_S)
    i, j = np.searchsorted(state.angles.ticks, [since, end], side="right")
    angles = take_angles(state.angles, slice(int(i), int(j)))
    if j - i < 8 or angles.ticks[-1] - angles.ticks[0] < settings.seed_span_s * TICKS_PER_S:
        return state
    if not len(state.imu) or state.imu.ticks[0] > since + settings.window:
        return state
    f = state.filter
    gyro_bias = np.zeros(3) if f is None else f.gyro_bias
    hits = gather(model, angles, state.imu, end, gyro_bias)
    fit = _fit(state, stations, hits, end, settings)
    if fit is None:
        return state
    # again, now that it is known which way it fell meanwhile
    hits = gather(model, angles, state.imu, end, gyro_bias, fit.guess.R)
    true = np.abs(residuals(stations, hits, fit.guess)[0]) < settings.seed_outlier_rad
    fit = refine(stations, hits.select(true), fit.guess, 10)
    acc_bias = np.zeros(3) if f is None else f.acc_bias
    fresh = start(end, fit, acc_bias, gyro_bias, settings.filter)
    if f is not None:
        fresh.P[9:, 9:] = f.P[9:, 9:]  # the biases outlive an occlusion
    return replace(
        state,
        filter=fresh,
        lost=False,
        disagreed=0,
        light=int(angles.ticks[-1]),
        rms_rad=fit.rms_rad,
    )


def _fit(
    state: TrackerState, stations: Stations, hits: Hits, end: int, settings: TrackerSettings
) -> Refined | None:
    """A pose good enough to start from: by the known rotation, else from nothing."""
    f = state.filter
    if f is not None and end - state.light < settings.rotation_known_s * TICKS_PER_S:
        fit = seed_with_rotation(stations, hits, f.R)
        if fit is not None and _is_good(stations, hits, fit, settings):
            return fit
    # dear, hence not in every window: a device that is not seen enough would stall the others
    if (end // settings.window) % settings.search_windows:
        return None
    up = state.imu.acc_g[-8:].mean(axis=0)
    fit = seed(stations, hits, up / max(float(np.linalg.norm(up)), 1e-9))
    return fit if fit is not None and _is_good(stations, hits, fit, settings) else None


def _is_good(stations: Stations, hits: Hits, fit: Refined, settings: TrackerSettings) -> bool:
    error = np.abs(residuals(stations, hits, fit.guess)[0])
    sigma = float(np.sqrt(np.trace(fit.covariance[:3, :3])))
    fits = float(np.mean(error < settings.seed_outlier_rad)) > 0.6
    return sigma < settings.seed_sigma_m and fit.rms_rad < settings.seed_rms_rad and fits


def _is_still(state: TrackerState, end: int, settings: TrackerSettings) -> bool:
    i, j = np.searchsorted(state.imu.ticks, [end - int(settings.rest_s * TICKS_PER_S), end])
    if j - i < 8 or state.imu.ticks[i] > end - 0.8 * settings.rest_s * TICKS_PER_S:
        return False
    gyro, acc = state.imu.gyro_rad_s[i:j], state.imu.acc_g[i:j]
    f = state.filter
    if (
        gyro.std(axis=0).max() > settings.rest_gyro_rad_s
        or acc.std(axis=0).max() > settings.rest_acc_g
    ):
        return False
    if f is None:
        return True
    turning = np.linalg.norm(gyro.mean(axis=0) - f.gyro_bias)
    return bool(
        turning < 5.0 * settings.rest_gyro_rad_s and np.linalg.norm(f.v) < settings.rest_speed_m_s
    )


def _rest_gyro(state: TrackerState, end: int, settings: TrackerSettings) -> Array:
    i, j = np.searchsorted(state.imu.ticks, [end - int(settings.rest_s * TICKS_PER_S), end])
    return np.asarray(state.imu.gyro_rad_s[i:j].mean(axis=0))


def _forget(state: TrackerState, end: int, settings: TrackerSettings) -> TrackerState:
    """Keep what the next windows need."""
    imu_since = end - int((settings.rest_s + 0.05) * TICKS_PER_S)
    light_since = end - int((settings.seed_s + 0.01) * TICKS_PER_S)
    i = int(np.searchsorted(state.imu.ticks, imu_since))
    j = int(np.searchsorted(state.angles.ticks, light_since))
    imu = ImuSamples(state.imu.ticks[i:], state.imu.acc_g[i:], state.imu.gyro_rad_s[i:])
    return replace(state, imu=imu, angles=take_angles(state.angles, slice(j, None)))


def join_poses(batches: Sequence[PoseBatch]) -> PoseBatch:
    """Poses one after the other."""
    full = [b for b in batches if len(b)]
    if not full:
        return PoseBatch(
            np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)),
            np.zeros((0, 3)), np.zeros((0, 6, 6)), np.zeros(0, np.int8),
        )  # fmt: skip
    return PoseBatch(
        np.concatenate([b.ticks for b in full]),
        np.concatenate([b.p for b in full]),
        np.concatenate([b.v for b in full]),
        np.concatenate([b.R for b in full]),
        np.concatenate([b.angular_velocity for b in full]),
        np.concatenate([b.covariance for b in full]),
        np.concatenate([b.fix for b in full]),
    )
