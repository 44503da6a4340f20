"""The pose that fits a handful of hits best: nonlinear least squares from a first guess."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from lobstr_hw.drivers.lighthouse.light import Flags, Hits, Stations, look
from lobstr_hw.rotations import Array, from_rotation_vector

__all__ = [
    "Guess",
    "Refined",
    "cross_matrix",
    "move",
    "refine",
    "residuals",
    "right_jacobian",
    "rms_rad",
]

HIT_SIGMA_RAD = 3e-4
"""What real stations and sensors are good for; the stations' model is no better than 1e-4."""
SPEED_SIGMA_M_S = 1.0
"""Hands move so fast; without it one station's 30 ms could not tell moving from lying elsewhere."""


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """Where a device may be at a moment: its IMU frame in the world, and its velocity there."""

    R: Array
    p: Array
    v: Array


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """A fitted pose.

    Attributes:
        guess: the pose and velocity.
        covariance: (9, 9) of position, rotation (in the IMU frame) and velocity.
        rms_rad: of the residuals, outliers weighed down.
        cost: of the fit, for comparing fits of the same hits.
        seen: share of the hits that could be: in view, on sensors that do not look away.
    """

    guess: Guess
    covariance: Array
    rms_rad: float
    cost: float
    seen: float


def cross_matrix(v: Array) -> Array:
    """Matrices (..., 3, 3) that take u to ``v cross u``."""
    K = np.zeros((*v.shape, 3))
    K[..., 2, 1], K[..., 0, 2], K[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return K - np.swapaxes(K, -1, -2)


def right_jacobian(w: Array) -> Array:
    """J (3, 3) with ``exp(w + d) = exp(w) exp(J d)`` for small d (Sola et al. 2018, eq. 143)."""
    angle = float(np.linalg.norm(w))
    K = cross_matrix(w)
    if angle < 1e-6:
        return np.asarray(np.eye(3) - 0.5 * K)
    a, b = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) - a * K + b * (K @ K))


def move(guess: Guess, x: Array) -> Guess:
    """A guess changed by position, rotation in the IMU frame, velocity (9,)."""
    return Guess(guess.R @ from_rotation_vector(x[3:6]), guess.p + x[:3], guess.v + x[6:9])


def residuals(stations: Stations, hits: Hits, guess: Guess) -> tuple[Array, Array, Flags]:
    """Angles (m,) too large, their derivative (m, 9) by position, rotation, velocity, and seen."""
    r = hits.points @ guess.R.T
    at = guess.p + r + hits.after_s[:, None] * guess.v
    angle, slope, seen = look(stations, hits.station, hits.axis, at, hits.normals @ guess.R.T)
    turn = -np.cross(slope, r) @ guess.R  # slope . (-[r]x R) = -(slope x r)^T R
    J = np.concatenate([slope, turn, hits.after_s[:, None] * slope], axis=1)
    return angle - hits.angle_rad, J, seen


def rms_rad(stations: Stations, hits: Hits, guess: Guess) -> float:
    """Root mean square of the residuals."""
    return float(np.sqrt(np.mean(residuals(stations, hits, guess)[0] ** 2)))


def refine(stations: Stations, hits: Hits, start: Guess, evaluations: int = 30) -> Refined:
    """Fit pose and velocity to hits from a guess within some 40 degrees.

    Args:
        stations: where they stand.
        hits: at least three; fewer than six leave something to the guess.
        start: at the hits' moment. Its velocity is kept as a weak prior.
        evaluations: of the model, at most.

    Returns:
        The fit at the hits' moment.
    """

    def weighed(x: Array) -> Array:
        error = residuals(stations, hits, move(start, x))[0] / HIT_SIGMA_RAD
        return np.concatenate([error, x[6:9] / SPEED_SIGMA_M_S])

    def slope(x: Array) -> Array:
        J = residuals(stations, hits, move(start, x))[1] / HIT_SIGMA_RAD
        J[:, 3:6] = J[:, 3:6] @ right_jacobian(x[3:6])
        return np.concatenate([J, np.eye(9)[6:9] / SPEED_SIGMA_M_S])

    fit = least_squares(
        weighed, np.zeros(9), slope, loss="soft_l1", x_scale="jac", max_nfev=evaluations
    )
    guess = move(start, fit.x)
    _, _, seen = residuals(stations, hits, guess)
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac)
    rms = HIT_SIGMA_RAD * float(np.sqrt(2.0 * fit.cost / max(len(hits), 1)))
    return Refined(guess, covariance, rms, float(fit.cost), float(np.mean(seen)))
