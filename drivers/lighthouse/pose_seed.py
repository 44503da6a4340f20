"""A first guess of a device's pose from hits alone: any sensors, on a plane or not, any stations.

For one rotation the position follows from linear equations (each hit puts its sensor on a plane of
light). So a grid over all rotations is tried at once, and the best few are refined; nothing is
assumed of how the sensors lie, and a mirrored solution is told apart by where its sensors look.
"""

from functools import cache

import numpy as np

from lobstr_hw.drivers.lighthouse.light import Hits, Stations, planes
from lobstr_hw.drivers.lighthouse.refine import Guess, Refined, refine, residuals
from lobstr_hw.rotations import Array, from_axis_angle, from_rotation_vector, rotation_between

__all__ = ["seed", "seed_with_rotation"]

DIRECTIONS, SPINS = 60, 12
"""720 rotations, none further than some 25 degrees from any other: within reach of refining."""
REFINED = 8
CLEARLY_RIGHT_RAD = 1.5e-4
"""A fit as good as the hits themselves: no need to look at the others."""
SEEN_AT_LEAST = 0.7
OUTLIER, OUTLIER_RAD, TRUE_AT_LEAST = 6.0, 1e-3, 0.6
"""Hits so many times further off than the middle one are reflections; most must be true."""
SAME_RISE = 0.1
"""Hands speed up by some metres per second squared: 0.3 g beside gravity tilt "up" 16 degrees."""
FEW = 60
"""Hits that are looked at until the choice is made; they come interleaved by sensor and station."""
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


def seed(
    stations: Stations, hits: Hits, up: Array | None = None, evaluations: int = 40
) -> Refined | None:
    """The pose from hits of about two turns of the rotors, nothing else known.

    Args:
        stations: where they stand.
        hits: at their moment; a moving device too (the gyroscope has turned them, the velocity is
            fitted).
        up: (3,) by the accelerometer, in the IMU frame, if the stations' world has Y up. It tells
            a flat set of sensors from its mirror image, which fits nearly as well from afar.
        evaluations: for the last refinement.

    Returns:
        The best fit, or None: too few hits, or none of the fits can be.
    """
    if len(hits) < MINIMUM_HITS or len(np.unique(hits.sensor)) < MINIMUM_SENSORS:
        return None
    fits: list[Refined] = []
    plain = not _is_flat(hits.points)
    few = hits.select(np.arange(len(hits)) % (1 + len(hits) // FEW) == 0)
    for guess in _ranked(stations, few, _rotations()):
        fits.append(refine(stations, few, guess, 8))
        if plain and fits[-1].rms_rad < CLEARLY_RIGHT_RAD and fits[-1].seen > 0.95:
            break
    return _best(stations, hits, _upright(fits, up), evaluations)


def _is_flat(points: Array) -> bool:
    size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(size[2] < 0.2 * size[0])


def _upright(fits: list[Refined], up: Array | None) -> list[Refined]:
    """Of fits that are about equally good, those that stand up as the accelerometer says."""
    possible = [f for f in fits if f.seen >= SEEN_AT_LEAST]
    if up is None or len(possible) < 2:
        return possible
    limit = max(3.0 * min(f.rms_rad for f in possible), OUTLIER_RAD)
    good = [f for f in possible if f.rms_rad <= limit]
    rise = [float((f.guess.R @ up)[1]) for f in good]
    return [f for f, r in zip(good, rise, strict=True) if r > max(rise) - SAME_RISE]


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
    error = np.abs(residuals(stations, hits, best.guess)[0])
    true = error < max(OUTLIER * float(np.median(error)), OUTLIER_RAD)
    if np.mean(true) < TRUE_AT_LEAST or np.count_nonzero(true) < MINIMUM_HITS // 2:
        return None
    if not np.all(true):
        best = refine(stations, hits.select(true), best.guess, evaluations)
    return best if best.seen >= SEEN_AT_LEAST else None


def _ranked(stations: Stations, hits: Hits, R: Array) -> list[Guess]:
    """For each rotation (j, 3, 3) the position that fits; the best of them first."""
    normal, offset = planes(stations, hits)  # (m, 3), (m,)
    lever = np.einsum("mi,jik,mk->jm", normal, R, hits.points, optimize=True)
    p = _positions(normal, offset - lever)
    centres = np.stack([stations[int(n)].T_world_station.p for n in hits.station])
    ahead = np.stack([-stations[int(n)].T_world_station.R[:, 2] for n in hits.station])
    away = p[:, None] - centres  # (j, m, 3)
    distance = np.maximum(np.linalg.norm(away, axis=2), 0.2)
    error = (lever + p @ normal.T - offset) / distance
    facing = np.einsum("jik,mk,jmi->jm", R, hits.normals, away, optimize=True) < 0.3 * distance
    front = np.einsum("jmi,mi->jm", away, ahead) > 0.0
    share = np.mean(facing & front, axis=1)
    # a quantile, not a mean: some hits are reflections
    cost = np.quantile(np.abs(error), 0.7, axis=1) / np.maximum(share, 0.05) ** 2
    order = np.argsort(cost, kind="stable")[:REFINED]
    return [Guess(R[j], p[j], np.zeros(3)) for j in order]


def _positions(normal: Array, right: Array) -> Array:
    """Positions (j, 3) that lie best on planes ``normal @ x = right`` (j, m), twice reweighed."""
    weight = np.ones(right.shape)
    for _ in range(3):
        # a trace of damping: with one axis only, the far direction is free
        square = np.einsum("jm,mi,mk->jik", weight, normal, normal, optimize=True)
        pull = (weight * right) @ normal
        p = np.linalg.solve(square + 1e-9 * np.eye(3), pull[..., None])[..., 0]
        off = np.abs(p @ normal.T - right)
        scale = np.maximum(3.0 * np.median(off, axis=1, keepdims=True), 1e-6)
        weight = 1.0 / (1.0 + (off / scale) ** 4)
    return np.asarray(p)
