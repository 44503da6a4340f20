"""All stations and all views of devices, fitted to all hits at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import coo_matrix, csr_matrix

from lobstr_hw.drivers.lighthouse.angles import Ints
from lobstr_hw.drivers.lighthouse.light import Flags, Hits, Station, look
from lobstr_hw.drivers.lighthouse.refine import (
    HIT_SIGMA_RAD,
    SPEED_SIGMA_M_S,
    Guess,
    move,
    right_jacobian,
)
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_rotation_vector

__all__ = ["bundle"]


IMU_SPEED_SIGMA_M_S = 0.05
"""What up.py gives: a few millimetres of the views over a quarter of a second."""


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """What is fitted: unknowns are 6 for each free station, then 9 for each view.

    Attributes:
        stations, guesses: where the fit starts.
        free: numbers of the stations that may move.
        hits: all of them.
        view: (m,) the view of each hit.
        speeds: (n, 3) prior of each view's velocity.
        speed_sigma: how well it is known, m/s.
    """

    stations: Mapping[int, Station]
    guesses: Sequence[Guess]
    free: tuple[int, ...]
    hits: Hits
    view: Ints
    speeds: Array
    speed_sigma: float

    def moved(self, x: Array) -> tuple[dict[int, Station], list[Guess]]:
        """Stations and views at the unknowns' values."""
        stations = dict(self.stations)
        for i, n in enumerate(self.free):
            T, d = self.stations[n].T_world_station, x[6 * i : 6 * i + 6]
            placed = Pose(T.R @ from_rotation_vector(d[3:]), T.p + d[:3])
            stations[n] = Station(self.stations[n].calibration, placed)
        rest = x[6 * len(self.free) :].reshape(-1, 9)
        return stations, [move(g, d) for g, d in zip(self.guesses, rest, strict=True)]

    def look(self, x: Array) -> tuple[Array, Array, Array, Flags]:
        """Residuals (m,), derivatives by station (m, 6) and by view (m, 9), possible (m,)."""
        stations, guesses = self.moved(x)
        R, p, v = (np.stack([getattr(g, k) for g in guesses])[self.view] for k in ("R", "p", "v"))
        after = self.hits.after_s[:, None]
        r = np.einsum("mij,mj->mi", R, self.hits.points)
        normal = np.einsum("mij,mj->mi", R, self.hits.normals)
        at = p + r + after * v
        angle, slope, seen = look(stations, self.hits.station, self.hits.axis, at, normal)
        turn = np.einsum("mi,mij->mj", -np.cross(slope, r), R)
        centre = np.stack([stations[int(n)].T_world_station.p for n in self.hits.station])
        facing = np.stack([stations[int(n)].T_world_station.R for n in self.hits.station])
        # R_s^T (x - c): turning the station by d moves the point by -d x (its place)
        station_turn = np.einsum("mi,mij->mj", np.cross(slope, at - centre), facing)
        by_station = np.concatenate([-slope, station_turn], axis=1)
        by_view = np.concatenate([slope, turn, after * slope], axis=1)
        return angle - self.hits.angle_rad, by_station, by_view, seen

    def residuals(self, x: Array) -> Array:
        """In sigmas, the prior of the velocities after the hits."""
        v = x[6 * len(self.free) :].reshape(-1, 9)[:, 6:]
        off = (np.stack([g.v for g in self.guesses]) + v - self.speeds).ravel()
        return np.concatenate([self.look(x)[0] / HIT_SIGMA_RAD, off / self.speed_sigma])

    def slopes(self, x: Array) -> csr_matrix:
        """The derivative of the residuals."""
        _, by_station, by_view, _ = self.look(x)
        m, first = len(self.hits), 6 * len(self.free)
        for i in range(len(self.free)):
            mine = self.hits.station == self.free[i]
            by_station[mine, 3:] = by_station[mine, 3:] @ right_jacobian(x[6 * i + 3 : 6 * i + 6])
        turned = np.stack([right_jacobian(d[3:6]) for d in x[first:].reshape(-1, 9)])
        by_view[:, 3:6] = np.einsum("mi,mij->mj", by_view[:, 3:6], turned[self.view])
        place = {n: 6 * i for i, n in enumerate(self.free)}
        free = np.flatnonzero(np.isin(self.hits.station, self.free))
        column = np.array([place[int(n)] for n in self.hits.station[free]], dtype=np.int64)
        k = np.arange(3 * len(self.guesses))
        rows = [np.repeat(free, 6), np.repeat(np.arange(m), 9), m + k]
        columns = [
            (column[:, None] + np.arange(6)).ravel(),
            (first + 9 * self.view[:, None] + np.arange(9)).ravel(),
            first + 9 * (k // 3) + 6 + k % 3,
        ]
        values = [
            by_station[free].ravel() / HIT_SIGMA_RAD,
            by_view.ravel() / HIT_SIGMA_RAD,
            np.full(len(k), 1.0 / self.speed_sigma),
        ]
        where = (np.concatenate(rows), np.concatenate(columns))
        return coo_matrix((np.concatenate(values), where), (m + len(k), len(x))).tocsr()


def bundle(
    stations: Mapping[int, Station],
    hits: Sequence[Hits],
    guesses: Sequence[Guess],
    evaluations: int,
    speeds: Array | None = None,
) -> tuple[dict[int, Station], list[Guess], dict[int, float]]:
    """Fit stations and views together.

    Args:
        stations: a first map; the first of them stays where it is, all else is relative to it.
        hits: of each view, of stations in the map only.
        guesses: the device at each view.
        evaluations: of the whole, at most.
        speeds: (n, 3) velocity at each view by the IMU; without: any that hands have.

    Returns:
        stations, the device at each view, and each station's median residual (rad).
    """
    view = np.repeat(np.arange(len(hits)), [len(h) for h in hits])
    prior = (np.zeros((len(guesses), 3)), SPEED_SIGMA_M_S)
    if speeds is not None:
        prior = (speeds, IMU_SPEED_SIGMA_M_S)
    problem = _Problem(stations, guesses, tuple(stations)[1:], _joined(hits), view, *prior)
    x = np.zeros(6 * len(problem.free) + 9 * len(guesses))
    fit = least_squares(
        problem.residuals,
        x,
        problem.slopes,
        loss="soft_l1",
        x_scale="jac",
        tr_solver="lsmr",
        tr_options={"maxiter": 3000, "atol": 1e-12, "btol": 1e-12},
        max_nfev=evaluations,
    )
    moved, views = problem.moved(fit.x)
    error = np.abs(problem.look(fit.x)[0])
    spread = {n: float(np.median(error[problem.hits.station == n])) for n in stations}
    return moved, views, spread


def _joined(hits: Sequence[Hits]) -> Hits:
    names = ("points", "normals", "after_s", "station", "axis", "sensor", "angle_rad")
    return Hits(*(np.concatenate([getattr(h, name) for h in hits]) for name in names))
