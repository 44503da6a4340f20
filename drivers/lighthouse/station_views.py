"""Moments at which a device is seen, and how it lies to each station then: where a solve begins."""

from collections.abc import Mapping, Sequence
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
from lobstr_hw.drivers.lighthouse.inertial import gather
from lobstr_hw.drivers.lighthouse.light import Hits, Station, take_angles
from lobstr_hw.drivers.lighthouse.pose_seed import seed
from lobstr_hw.drivers.lighthouse.refine import rms_rad
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array

__all__ = ["Take", "View", "find_views", "hits_at"]

AROUND_S = 0.02
"""Hits so far from the moment belong to it: a turn of the rotors each way."""
FIT_RAD = 1e-3
"""A view whose hits fit worse is a wrong one."""


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """What one device saw while it was carried about; angles by time."""

    model: DeviceModel
    imu: ImuSamples
    angles: Angles


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One device at one moment.

    Attributes:
        take: which of the takes.
        ticks: the moment, on the device's clock.
        hits: around it, of all the stations below.
        T_station_imu: the device in each station's frame, by the station's number.
        fit_rad: how well each of them fits.
    """

    take: int
    ticks: int
    hits: Hits
    T_station_imu: Mapping[int, Pose]
    fit_rad: Mapping[int, float]


def find_views(
    takes: Sequence[Take],
    calibrations: Mapping[int, StationCalibration],
    spacing_s: float = 0.25,
    at_most: int = 40,
) -> list[View]:
    """Moments of the takes at which at least one station gives the device's pose.

    Args:
        takes: of the same stations, at the same time or one after the other.
        calibrations: by the station's number; hits of others are left out.
        spacing_s: between moments.
        at_most: so many, spread over all of the takes.
    """
    moments = [(k, int(t)) for k, take in enumerate(takes) for t in _moments(take, spacing_s)]
    views = [_view(k, takes[k], t, calibrations) for k, t in _spread(moments, at_most)]
    return [v for v in views if v is not None]


def _spread(moments: list[tuple[int, int]], at_most: int) -> list[tuple[int, int]]:
    """Some of the moments from all of the time, in runs of four: up is told by neighbours."""
    if len(moments) <= at_most:
        return moments
    begin = np.linspace(0, len(moments) - 4, at_most // 4).round().astype(int)
    return [moments[i] for i in np.unique(begin[:, None] + np.arange(4))]


def _moments(take: Take, spacing_s: float) -> Ints:
    if not len(take.angles) or len(take.imu) < 2:
        return np.zeros(0, np.int64)
    margin = int(2 * AROUND_S * TICKS_PER_S)
    first = max(int(take.angles.ticks[0]), int(take.imu.ticks[0])) + margin
    last = min(int(take.angles.ticks[-1]), int(take.imu.ticks[-1])) - margin
    return np.arange(first, last, int(spacing_s * TICKS_PER_S))


def hits_at(take: Take, ticks: int, stations: Sequence[int], R: Array | None = None) -> Hits | None:
    """A take's hits around a moment; None: too few. ``R``: as in :func:`gather`."""
    around = int(AROUND_S * TICKS_PER_S)
    i, j = np.searchsorted(take.angles.ticks, [ticks - around, ticks + around])
    angles = take_angles(take.angles, slice(int(i), int(j)))
    angles = take_angles(angles, np.isin(angles.station, stations))
    k, n = np.searchsorted(take.imu.ticks, [ticks - 2 * around, ticks + 2 * around])
    if len(angles) < 8 or n - k < 2:
        return None
    imu = ImuSamples(take.imu.ticks[k:n], take.imu.acc_g[k:n], take.imu.gyro_rad_s[k:n])
    return gather(take.model, angles, imu, ticks, np.zeros(3), R)


def _view(
    number: int, take: Take, ticks: int, calibrations: Mapping[int, StationCalibration]
) -> View | None:
    hits = hits_at(take, ticks, list(calibrations))
    if hits is None:
        return None
    poses, fits = {}, {}
    for station in np.unique(hits.station):
        mine = hits.select(hits.station == station)
        if len(np.unique(mine.axis)) < 2:
            continue
        alone = {int(station): Station(calibrations[int(station)], Pose.identity())}
        fit = seed(alone, mine)
        if fit is not None and (rms := rms_rad(alone, mine, fit.guess)) < FIT_RAD:
            poses[int(station)] = Pose(fit.guess.R, fit.guess.p)
            fits[int(station)] = rms
    hits = hits.select(np.isin(hits.station, list(poses)))
    return View(number, ticks, hits, poses, fits) if poses else None
