"""A first map of the stations: those that see a device at one moment are related through it."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import StationCalibration
from lobstr_hw.drivers.lighthouse.light import Station, Stations
from lobstr_hw.drivers.lighthouse.refine import Guess, refine, rms_rad
from lobstr_hw.drivers.lighthouse.station_views import View
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import geodesic_angle, rotation_mean

__all__ = ["first_guess", "first_map"]

TOGETHER_AT_LEAST = 2
"""One view alone may be mirrored."""


def first_map(
    views: Sequence[View], calibrations: Mapping[int, StationCalibration]
) -> dict[int, Station]:
    """Stations in the frame of the one seen most, as far as shared views lead (a widest tree)."""
    seen = [n for v in views for n in v.T_station_imu]
    first = max(sorted(set(seen)), key=seen.count)
    ties = _ties(views)
    poses = {first: Pose.identity()}
    while True:
        open_ties = [
            (count, a, b, T)
            for (a, b), (count, T) in ties.items()
            if a in poses and b not in poses and count >= TOGETHER_AT_LEAST
        ]
        if not open_ties:
            return {n: Station(calibrations[n], T) for n, T in poses.items()}
        _, a, b, T = max(open_ties, key=lambda tie: (tie[0], -tie[2]))
        poses[b] = poses[a] @ T


def _ties(views: Sequence[View]) -> dict[tuple[int, int], tuple[int, Pose]]:
    """For stations a, b: at how many views they agree on where b is in a, and where."""
    found: dict[tuple[int, int], list[Pose]] = {}
    for view in views:
        for a, b in combinations(sorted(view.T_station_imu), 2):
            T = view.T_station_imu[a] @ view.T_station_imu[b].inverse()
            found.setdefault((a, b), []).append(T)
    ties = {}
    for (a, b), poses in found.items():
        count, T = _middle(poses)
        ties[a, b], ties[b, a] = (count, T), (count, T.inverse())
    return ties


def _middle(poses: list[Pose]) -> tuple[int, Pose]:
    """The pose that most are near to: the best placed one, then the mean of those around it."""
    R, p = np.stack([T.R for T in poses]), np.stack([T.p for T in poses])
    apart = np.linalg.norm(p[:, None] - p[None], axis=2) + geodesic_angle(R[:, None], R[None])
    best = int(np.argmin(np.median(apart, axis=1)))
    near = apart[best] <= max(2.0 * float(np.median(apart[best])), 0.05)
    near &= apart[best] < 1.0
    return int(np.count_nonzero(near)), Pose(rotation_mean(R[near]), p[near].mean(axis=0))


def first_guess(view: View, stations: Stations) -> Guess | None:
    """The device at a view in a first map, or None where no station of the map fits."""
    known = [n for n in view.T_station_imu if n in stations]
    if not known:
        return None
    hits = view.hits.select(np.isin(view.hits.station, known))
    candidates = [stations[n].T_world_station @ view.T_station_imu[n] for n in known]
    guesses = [Guess(T.R, T.p, np.zeros(3)) for T in candidates]
    best = min(guesses, key=lambda g: rms_rad(stations, hits, g))
    return refine(stations, hits, best, 15).guess
