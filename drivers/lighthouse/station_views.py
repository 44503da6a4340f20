"""Moments at which a device is seen, and how it lies to each station then: where a solve begins."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

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
from lobstr_hw.drivers.lighthouse.light import Flags, Hits, Station, take_angles
from lobstr_hw.drivers.lighthouse.pose_seed import seed
from lobstr_hw.drivers.lighthouse.refine import residuals
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array

__all__ = ["Take", "View", "find_views", "hits_of"]

ZERO = np.zeros(3)
HITS_AT_LEAST = 8
AROUND_S = 0.02
"""Hits so far from the moment belong to it: a turn of the rotors each way."""
FIT_RAD = 1e-3
"""A view whose hits fit worse is a wrong one."""
OUTLIER, OUTLIER_RAD, TRUE_AT_LEAST = 6.0, 1e-3, 0.85
"""Hits so many times further off than the middle one, and so far, are reflections: a device that
lies still sees the same one all the time. Where more are off, the pose may be the mirrored one."""


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
        angles: around it, of all the stations below, without reflections.
        hits: the same, as they lie at the moment.
        T_station_imu: the device in each station's frame, by the station's number.
        fit_rad: how well each of them fits.
    """

    take: int
    ticks: int
    angles: Angles
    hits: Hits
    T_station_imu: Mapping[int, Pose]
    fit_rad: Mapping[int, float]

    def select(self, which: Flags) -> "View":
        """With those hits only."""
        angles, hits = take_angles(self.angles, which), self.hits.select(which)
        return replace(self, angles=angles, hits=hits)


def find_views(
    takes: Sequence[Take],
    calibrations: Mapping[int, StationCalibration],
    spacing_s: float = 0.25,
    at_most: int = 40,
    progress: Callable[[float], None] | None = None,
) -> list[View]:
    """Moments of the takes at which at least one station gives the device's pose.

    Args:
        takes: of the same stations, at the same time or one after the other.
        calibrations: by the station's number; hits of others are left out.
        spacing_s: between moments.
        at_most: so many, spread over all of the takes.
        progress: is told the share that is done, 0 to 1.
    """
    moments = [(k, int(t)) for k, take in enumerate(takes) for t in _moments(take, spacing_s)]
    chosen = _spread(moments, at_most)
    views = []
    for done, (k, t) in enumerate(chosen):
        views.append(_view(k, takes[k], t, calibrations))
        if progress is not None:
            progress((done + 1) / len(chosen))
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


def hits_of(take: Take, view: View, R: Array) -> Hits:
    """A view's hits again, now that the device's rotation is known: as in :func:`gather`."""
    return gather(take.model, view.angles, _imu_around(take, view.ticks), view.ticks, ZERO, R)


def _imu_around(take: Take, ticks: int) -> ImuSamples:
    around = int(2 * AROUND_S * TICKS_PER_S)
    k, n = np.searchsorted(take.imu.ticks, [ticks - around, ticks + around])
    return take.imu.take(slice(k, n))


def _view(
    number: int, take: Take, ticks: int, calibrations: Mapping[int, StationCalibration]
) -> View | None:
    around = int(AROUND_S * TICKS_PER_S)
    i, j = np.searchsorted(take.angles.ticks, [ticks - around, ticks + around])
    angles = take_angles(take.angles, slice(int(i), int(j)))
    angles = take_angles(angles, np.isin(angles.station, list(calibrations)))
    imu = _imu_around(take, ticks)
    if len(angles) < HITS_AT_LEAST or len(imu) < 2:
        return None
    hits = gather(take.model, angles, imu, ticks, ZERO)
    poses, fits, true = {}, {}, np.zeros(len(hits), dtype=np.bool_)
    for station in np.unique(hits.station).tolist():
        mine = hits.station == station
        found = _alone(Station(calibrations[station], Pose.identity()), hits.select(mine))
        if found is not None:
            poses[station], fits[station], good = found
            true[mine] = good
    return View(number, ticks, angles, hits, poses, fits).select(true) if poses else None


def _alone(station: Station, hits: Hits) -> tuple[Pose, float, Flags] | None:
    """The device in a station's frame by its own hits, how well they fit, which were true."""
    number = int(hits.station[0])
    fit = seed({number: station}, hits) if len(np.unique(hits.axis)) == 2 else None
    if fit is None:
        return None
    error = np.abs(residuals({number: station}, hits, fit.guess)[0])
    true = error < max(OUTLIER * float(np.median(error)), OUTLIER_RAD)
    rms = float(np.sqrt(np.mean(error[true] ** 2)))
    enough = np.mean(true) >= TRUE_AT_LEAST and np.count_nonzero(true) >= HITS_AT_LEAST
    if rms > FIT_RAD or not enough:
        return None
    return Pose(fit.guess.R, fit.guess.p), rms, true
