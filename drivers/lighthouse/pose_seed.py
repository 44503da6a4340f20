"""A first guess of a device's pose from hits alone: any sensors, on a plane or not, any stations.

For one rotation the position follows from linear equations (each hit puts its sensor on a plane of
light). So a grid over all rotations is tried at once, and the best few are refined; nothing is
assumed of how the sensors lie, and a mirrored solution is told apart by where its sensors look.
"""

from functools import cache

import numpy as np

from lobstr_hw.drivers.lighthouse.light import Hits, Stations, planes
from lobstr_hw.drivers.lighthouse.refine import Guess, Refined, refine
from lobstr_hw.rotations import Array, from_axis_angle, from_rotation_vector, rotation_between

__all__ = ["seed", "seed_with_rotation"]

DIRECTIONS, SPINS = 60, 12
"""720 rotations, none further than some 25 degrees from any other: within reach of refining."""
REFINED = 8
CLEARLY_RIGHT_RAD = 1.5e-4
"""A fit as good as the hits themselves: no need to look at the others."""
SEEN_AT_LEAST = 0.7
MINIMUM_HITS = 8
MINIMUM_SENSORS = 4


@cache
def _rotations() -> Array:
    i = np.arange(DIRECTIONS) + 0.5  # points of a sphere, evenly (Fibonacci)
    z, turn = 1.0 - 2.0 * i / DIRECTIONS, np.pi * (1.0 + np.sqrt(5.0)) * i
    level = np.sqrt(1.0 - z**2)
    axis = np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)
    tip = rotation_between(np.array([0.0, 0.0, 1.0]), axis)
    spin = from_axis_angle(np.array([0.0, 0.0, 1.0]), np.arange(SPINS) * 2.0 * np.pi / SPINS)
    return np.asarray((tip[:, None] @ spin[None]).reshape(-1, 3, 3))


def seed(stations: Stations, hits: Hits, evaluations: int = 40) -> Refined | None:
    """The pose from hits of about two turns of the rotors, nothing else known.

    Args:
        stations: where they stand.
        hits: at their moment; a moving device too (the gyroscope has turned them, the velocity is
            fitted).
        evaluations: for the last refinement.

    Returns:
        The best fit, or None: too few hits, or none of the fits can be.
    """
    if len(hits) < MINIMUM_HITS or len(np.unique(hits.sensor)) < MINIMUM_SENSORS:
        return None
    fits: list[Refined] = []
    for guess in _ranked(stations, hits, _rotations()):
        fits.append(refine(stations, hits, guess, 8))
        if fits[-1].rms_rad < CLEARLY_RIGHT_RAD and fits[-1].seen > 0.95:
            break
    return _best(stations, hits, fits, evaluations)


def seed_with_rotation(stations: Stations, hits: Hits, R: Array) -> Refined | None:
    """The pose when the rotation is roughly known, as after an occlusion: much quicker."""
    if len(hits) < MINIMUM_HITS // 2:
        return None
    near = R @ from_rotation_vector(0.3 * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)]))
    guesses = _ranked(stations, hits, near)[:1]
    return _best(stations, hits, [refine(stations, hits, g, 15) for g in guesses], 20)


def _best(stations: Stations, hits: Hits, fits: list[Refined], evaluations: int) -> Refined | None:
    possible = [f for f in fits if f.seen >= SEEN_AT_LEAST]
    if not possible:
        return None
    best = min(possible, key=lambda f: f.cost)
    best = refine(stations, hits, best.guess, evaluations)
    return best if best.seen >= SEEN_AT_LEAST else None


def _ranked(stations: Stations, hits: Hits, R: Array) -> list[Guess]:
    """For each rotation (j, 3, 3) the position that fits; the best of them first."""
    normal, offset = planes(stations, hits)  # (m, 3), (m,)
    lever = np.einsum("mi,jik,mk->jm", normal, R, hits.points, optimize=True)
    pull = (offset - lever) @ normal  # (j, 3)
    # a trace of damping: with one axis only, the far direction is free
    square = normal.T @ normal + 1e-9 * np.eye(3)
    p = pull @ np.linalg.inv(square)
    centres = np.stack([stations[int(n)].T_world_station.p for n in hits.station])
    ahead = np.stack([-stations[int(n)].T_world_station.R[:, 2] for n in hits.station])
    away = p[:, None] - centres  # (j, m, 3)
    distance = np.maximum(np.linalg.norm(away, axis=2), 0.2)
    error = (lever + p @ normal.T - offset) / distance
    facing = np.einsum("jik,mk,jmi->jm", R, hits.normals, away, optimize=True) < 0.3 * distance
    front = np.einsum("jmi,mi->jm", away, ahead) > 0.0
    share = np.mean(facing & front, axis=1)
    cost = np.mean(error**2, axis=1) / np.maximum(share, 0.05) ** 4
    order = np.argsort(cost, kind="stable")[:REFINED]
    return [Guess(R[j], p[j], np.zeros(3)) for j in order]
