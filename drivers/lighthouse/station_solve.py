"""Where the base stations stand, from what devices saw while they were carried about.

1. Views: moments at which one station or more see a device; each alone gives the device in its
   frame (station_views.py).
2. A first map: stations that see the device at one moment are related; the relations that most
   views agree on tie all stations into one tree (station_map.py).
3. A bundle: all stations and all views are fitted to all hits at once (bundle.py). The size of
   everything comes from the distances between a device's sensors.
4. Up: from the IMU's movement between views (up.py).
5. A place: the lowest view is the floor's height, the lowest-numbered station straight ahead (-Z).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import StationCalibration
from lobstr_hw.drivers.lighthouse.bundle import bundle
from lobstr_hw.drivers.lighthouse.light import Station, Stations
from lobstr_hw.drivers.lighthouse.refine import Guess, rms_rad
from lobstr_hw.drivers.lighthouse.station_map import first_guess, first_map
from lobstr_hw.drivers.lighthouse.station_views import Take, View, find_views, hits_of
from lobstr_hw.drivers.lighthouse.up import measure_up
from lobstr_hw.errors import StationsNotSolved
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, rotation_between, rotation_y

__all__ = ["StationSolution", "solve_stations"]

VIEWS_AT_LEAST = 3
REPEATS = 2
VIEWS_SHARE = 0.7
"""Of the work: the views."""
MISFIT_RAD = 0.05
"""A view that fits worse in the first map is mirrored or mistaken."""


@dataclass(frozen=True, slots=True, eq=False)
class StationSolution:
    """Solved stations.

    Attributes:
        stations: by number, in the world (Y up).
        residual_rad: each station's median residual.
        views: at how many moments each station was seen.
        up_sigma_rad: how well up is known.
        unsolved: stations that were seen, but never together with the others.
    """

    stations: dict[int, Station]
    residual_rad: dict[int, float]
    views: dict[int, int]
    up_sigma_rad: float
    unsolved: tuple[int, ...]


def solve_stations(
    takes: Sequence[Take],
    calibrations: Mapping[int, StationCalibration],
    at_most: int = 48,
    evaluations: int = 60,
    progress: Callable[[float], None] = lambda share: None,
) -> StationSolution:
    """Solve where the stations stand.

    Args:
        takes: of devices that were carried through the room, in all at least some seconds.
        calibrations: of the stations, by number; others are left out.
        at_most: moments to use.
        evaluations: of the bundle.
        progress: is told about the share of the work that is done, 0 to 1.

    Raises:
        StationsNotSolved: the stations were not seen well enough.
    """
    views = find_views(
        takes, calibrations, at_most=at_most, progress=lambda share: progress(VIEWS_SHARE * share)
    )
    if len(views) < VIEWS_AT_LEAST:
        raise StationsNotSolved(
            f"base stations were seen well at {len(views)} moments, {VIEWS_AT_LEAST} are needed:"
            " carry a tracker slowly through the room, in sight of all stations."
        )
    seen = [n for v in views for n in v.T_station_imu]
    rough = first_map(views, calibrations)
    views, guesses = _fitting(views, rough)
    stations, guesses, residual = bundle(rough, [v.hits for v in views], guesses, evaluations)
    upright = measure_up(takes, views, guesses, stations)
    for k in range(REPEATS):
        progress(VIEWS_SHARE + (1.0 - VIEWS_SHARE) * (k + 1) / (REPEATS + 1))
        # once more, now that it is known how the devices moved around each view
        level = rotation_between(upright.up, np.array([0.0, 1.0, 0.0]))
        hits = [hits_of(takes[v.take], v, level @ g.R) for v, g in zip(views, guesses, strict=True)]
        stations, guesses, residual = bundle(stations, hits, guesses, evaluations, upright.v)
        upright = measure_up(takes, views, guesses, stations)
    progress(1.0)
    return StationSolution(
        _placed(stations, guesses, upright.up),
        residual,
        {n: seen.count(n) for n in sorted(stations)},
        upright.sigma_rad,
        tuple(sorted(set(seen) - set(stations))),
    )


def _fitting(views: Sequence[View], rough: Stations) -> tuple[list[View], list[Guess]]:
    """The views that fit into a first map, without hits of stations that are not in it."""
    kept: list[View] = []
    guesses: list[Guess] = []
    for view in views:
        known = {n: T for n, T in view.T_station_imu.items() if n in rough}
        guess = first_guess(view, rough)
        if guess is None:
            continue
        there = view.select(np.isin(view.hits.station, list(known)))
        if rms_rad(rough, there.hits, guess) < MISFIT_RAD:
            kept.append(there)
            guesses.append(guess)
    if len(kept) < VIEWS_AT_LEAST:
        raise StationsNotSolved(
            "what the base stations saw does not fit together: was one of them moved meanwhile?"
            " Carry a tracker slowly through the room again."
        )
    return kept, guesses


def _placed(stations: Stations, guesses: Sequence[Guess], up: Array) -> dict[int, Station]:
    """Stations in a world with Y up, the floor under the lowest view, the first station ahead."""
    level = rotation_between(up, np.array([0.0, 1.0, 0.0]))
    places = np.stack([g.p for g in guesses]) @ level.T
    origin = np.median(places, axis=0)
    origin[1] = places[:, 1].min()
    first = level @ stations[min(stations)].T_world_station.p - origin
    turn = rotation_y(np.pi - np.arctan2(first[0], first[2]))  # its heading becomes -Z
    T = Pose(turn @ level, -turn @ origin)
    return {n: Station(s.calibration, T @ s.T_world_station) for n, s in sorted(stations.items())}
