"""From one device's angles and IMU samples to poses, one for every IMU sample.

State in, state out. All steps are taken at fixed places of the device's own time: light is used in
windows of 12 ms, each once the IMU has come 30 ms further (a sweep is known only at its end, and
light and IMU come by different ways). So poses do not depend on when a packet arrived.

    windows of light   |----E-12ms---|----E----|----E+12ms---|
    IMU sample at t    its pose: the state at E, dead reckoned to t, for E + 30 ms < t <= E + 42 ms
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, DeviceModel, ImuSamples
from lobstr_hw.drivers.lighthouse.inertial import Track, reckon
from lobstr_hw.drivers.lighthouse.kalman import (
    FilterState,
    LightReport,
    advance,
    correct_with_light,
    correct_with_rest,
    covariance,
)
from lobstr_hw.drivers.lighthouse.light import Flags, Stations, join_angles, take_angles
from lobstr_hw.drivers.lighthouse.reacquire import reacquire, second_look
from lobstr_hw.drivers.lighthouse.rest import is_still, rest_gyro
from lobstr_hw.drivers.lighthouse.tracker_state import (
    Fix,
    PoseBatch,
    Tail,
    TrackerSettings,
    TrackerState,
    begin,
    join_poses,
)

NUMBERS = 256
NO_POSES = join_poses([])
FADES = 0.7
"""What hits of a window count for in the next: some 40 ms are remembered."""
TRUE_SHARE, TRIAL_WINDOWS = 0.7, 3
"""Of the hits that a pose on trial must agree with; windows in a row that end the trial."""

__all__ = ["Fix", "PoseBatch", "TrackerSettings", "TrackerState", "begin", "join_poses", "step"]


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
    state = _take_light(state, stations, angles)
    given: list[PoseBatch] = []
    for part in _unbroken(state, imu, settings):
        state = _take_imu(state, part, settings)
        newest = int(state.imu.ticks[-1])
        while newest >= (usable := state.window_end + settings.window + settings.lag):
            state, batch = _give(state, usable, settings)
            given.append(batch)
            state = _window(state, model, stations, settings)
        state, batch = _give(state, newest, settings)
        given.append(batch)
    return state, join_poses(given)


def _take_light(state: TrackerState, stations: Stations, angles: Angles) -> TrackerState:
    if not len(angles):
        return state
    done = state.window_end if state.filter is None else state.filter.ticks
    keep = (angles.ticks > done) & _known(tuple(stations))[angles.station]
    return replace(state, angles=join_angles([state.angles, take_angles(angles, keep)]))


@lru_cache(maxsize=32)
def _known(numbers: tuple[int, ...]) -> Flags:
    """Which station numbers are known, by number."""
    known = np.zeros(NUMBERS, dtype=np.bool_)
    known[list(numbers)] = True
    return known


def _unbroken(
    state: TrackerState, imu: ImuSamples, settings: TrackerSettings
) -> Iterator[ImuSamples]:
    """New samples in stretches without a gap."""
    since = state.imu.ticks[-1] if len(state.imu) else -(2**62)
    new = np.flatnonzero(imu.ticks > since)
    gaps = np.flatnonzero(np.diff(imu.ticks[new]) > settings.lost_s * TICKS_PER_S)
    if len(new) == len(imu) and not len(gaps):
        yield from (imu,) if len(imu) else ()
        return
    for i in np.split(new, gaps + 1):
        if len(i):
            yield imu.take(i)


def _take_imu(state: TrackerState, imu: ImuSamples, settings: TrackerSettings) -> TrackerState:
    old = state.imu
    if len(old) and imu.ticks[0] - old.ticks[-1] > settings.lost_s * TICKS_PER_S:
        # nobody knows what it did meanwhile: as if it had just been switched on
        state = replace(begin(), given=state.given, angles=state.angles)
    joined = ImuSamples.join([state.imu, imu])
    # windows lie at multiples of their length, wherever a recording begins
    first = int(joined.ticks[0]) // settings.window * settings.window
    return replace(state, imu=joined, window_end=max(state.window_end, first))


def _reckon(state: TrackerState, f: FilterState, tail: FilterState | Tail, until: int) -> Track:
    """Dead reckoning from a sample's moment through those up to another."""
    i, j = np.searchsorted(state.imu.ticks, [tail.ticks, until + 1])
    imu = state.imu.take(slice(i, j))
    return reckon(imu, tail.p, tail.v, tail.R, f.acc_bias, f.gyro_bias)


def _give(
    state: TrackerState, until: int, settings: TrackerSettings
) -> tuple[TrackerState, PoseBatch]:
    """The poses of samples not given yet, up to a moment."""
    f, tail = state.filter, state.tail
    if f is None or tail is None or (state.lost and state.place is None):
        return replace(state, given=max(state.given, until)), NO_POSES
    newest = state.imu.ticks[int(np.searchsorted(state.imu.ticks, until, side="right")) - 1]
    if newest <= tail.ticks:
        return state, NO_POSES
    track = _reckon(state, f, tail, until)
    end = Tail(int(track.ticks[-1]), track.p[-1], track.v[-1], track.R[-1], tail.covariance)
    new = int(np.searchsorted(track.ticks, state.given, side="right"))
    state = replace(state, tail=end, given=max(state.given, end.ticks))
    return state, _batch(state, f, track, max(new, 1), settings)


def _batch(
    state: TrackerState, f: FilterState, track: Track, new: int, settings: TrackerSettings
) -> PoseBatch:
    """What is said of a track's samples, from one of them on."""
    ticks, p, v = track.ticks[new:], track.p[new:], track.v[new:]
    k = len(ticks)
    fix = np.full(k, Fix.LIGHT, dtype=np.int8)
    dark_s = (ticks - state.light) / TICKS_PER_S
    fix[dark_s > settings.inertial_s] = Fix.INERTIAL
    if state.still:
        p, v = np.tile(f.p, (k, 1)), np.zeros((k, 3))
    if state.lost and state.place is not None:
        p, v, fix[:] = np.tile(state.place, (k, 1)), np.zeros((k, 3)), Fix.LOST
    elif k and dark_s[-1] > settings.lost_s:
        lost = np.flatnonzero(dark_s > settings.lost_s)
        p, v = p.copy(), v.copy()
        p[lost], v[lost], fix[lost] = track.p[new + lost[0] - 1], 0.0, Fix.LOST
    assert state.tail is not None
    P = np.broadcast_to(state.tail.covariance, (k, 6, 6))
    return PoseBatch(ticks, p, v, track.R[new:], track.gyro[new:], P, fix)


def _window(
    state: TrackerState, model: DeviceModel, stations: Stations, settings: TrackerSettings
) -> TrackerState:
    """Use the next window of light, up to its last IMU sample."""
    border = state.window_end + settings.window
    last = int(np.searchsorted(state.imu.ticks, border, side="right")) - 1
    end = int(state.imu.ticks[max(last, 0)])
    f = state.filter
    if last < 0 or end <= (border - settings.window if f is None else f.ticks):
        return replace(state, window_end=border)  # samples were lost: there is none in it
    state = replace(state, window_end=border, still=is_still(state, end, settings))
    if f is not None:
        state = _filter_window(state, f, end, model, stations, settings)
    if state.lost and not state.on_trial:
        state = reacquire(state, end, model, stations, settings)
    elif _is_doubtful(state, end, settings):
        state = second_look(state, end, model, stations, settings)
    return _forget(state, end, _tail(state, border + settings.lag, settings), settings)


def _tail(state: TrackerState, until: int, settings: TrackerSettings) -> Tail | None:
    """The filter's state, reckoned through the samples that were there when its window was used."""
    f = state.filter
    if f is None:
        return None
    track = _reckon(state, f, f, until)
    calm = settings.filter.rest_calm if state.still else 1.0
    P = covariance(f, track, settings.filter, calm)
    return Tail(int(track.ticks[-1]), track.p[-1], track.v[-1], track.R[-1], P)


def _is_doubtful(state: TrackerState, end: int, settings: TrackerSettings) -> bool:
    """Too few of the latest hits are believed, and nobody looked for another pose lately."""
    few = state.believed < settings.doubt_share * state.seen
    rested = end - state.looked > settings.doubt_s * TICKS_PER_S
    return few and rested and state.seen > settings.doubt_hits and not state.lost


def _filter_window(
    state: TrackerState,
    f: FilterState,
    end: int,
    model: DeviceModel,
    stations: Stations,
    settings: TrackerSettings,
) -> TrackerState:
    track = _reckon(state, f, f, end)
    if state.lost and not state.on_trial:
        return replace(state, filter=_turn_only(f, track))
    calm = settings.filter.rest_calm if state.still else 1.0
    now = advance(f, track, settings.filter, calm)
    i, j = np.searchsorted(state.angles.ticks, [f.ticks, end], side="right")
    if j > i:
        window = take_angles(state.angles, slice(int(i), int(j)))
        now, report = correct_with_light(now, track, window, model, stations, settings.filter)
        state = _believe(state, report, int(window.ticks[-1]), settings)
    if state.still:
        now = correct_with_rest(now, rest_gyro(state, end, settings), settings.filter)
    return _judge(replace(state, filter=now), f, now, end, settings)


def _believe(
    state: TrackerState, report: LightReport, newest: int, settings: TrackerSettings
) -> TrackerState:
    """Keep count of how well light fits."""
    fits = 2 * report.used >= report.hits
    if state.on_trial:  # it is so unsure at first that nearly every hit would do
        fits = fits and report.rms_rad < settings.seed_outlier_rad
    good = report.used >= 2 and fits
    return replace(
        state,
        disagreed=0 if fits else state.disagreed + 1,
        seen=FADES * state.seen + report.hits,
        believed=FADES * state.believed + (report.used if fits else 0),
        light=newest if good else state.light,
        rms_rad=report.rms_rad if good else state.rms_rad,
    )


def _judge(
    state: TrackerState, before: FilterState, now: FilterState, end: int, settings: TrackerSettings
) -> TrackerState:
    """Lost when too long without light, too unsure, or light keeps disagreeing."""
    variance = np.trace(now.P[:3, :3])
    dark = end - state.light > settings.lost_s * TICKS_PER_S
    if state.on_trial:
        sure = variance < settings.trial_sigma_m**2 and state.believed > settings.trial_hits
        if sure and state.believed > TRUE_SHARE * state.seen:
            return replace(state, lost=False, on_trial=False)
        if not dark and state.disagreed < TRIAL_WINDOWS:
            return state
    elif not (
        dark or variance > settings.lost_sigma_m**2 or state.disagreed >= settings.disagree_windows
    ):
        return state
    return replace(
        state,
        lost=True,
        on_trial=False,
        place=state.place if state.lost else before.p,
        disagreed=0,
        filter=replace(now, p=before.p, v=np.zeros(3)),
    )


def _turn_only(f: FilterState, track: Track) -> FilterState:
    """Follow the rotation, leave the position."""
    P = f.P.copy()
    P[:3, :3] += np.eye(3) * 0.01**2  # a centimetre more each window: nobody shall trust it
    return replace(f, ticks=int(track.ticks[-1]), R=track.R[-1], v=np.zeros(3), P=P)


def _forget(
    state: TrackerState, end: int, tail: Tail | None, settings: TrackerSettings
) -> TrackerState:
    """Keep what the next windows need."""
    imu_since = end - int((settings.rest_s + 0.05) * TICKS_PER_S)
    light_since = end - int((settings.seed_s + 0.01) * TICKS_PER_S)
    i = int(np.searchsorted(state.imu.ticks, imu_since))
    j = int(np.searchsorted(state.angles.ticks, light_since))
    imu = state.imu.take(slice(i, None))
    return replace(state, imu=imu, angles=take_angles(state.angles, slice(j, None)), tail=tail)
