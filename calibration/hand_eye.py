"""Two trackers on one rigid thing, each in a tracking space of its own.

With X from space b to space a and Y from tracker b to tracker a, for every moment

    T_a_trackera Y = X T_b_trackerb

("robot-world/hand-eye calibration"). Rotations first, by the Kronecker product (Shah 2013, "Solving
the robot-world/hand-eye calibration problem using the Kronecker product", section 3); then the
positions, which are linear.
"""

import math

import numpy as np

from lobstr_hw.rotations import Array, rotation_mean, transpose

__all__ = ["fit_positions", "fit_rotations", "wobble"]

_ROUNDS = 5


def fit_rotations(R_a: Array, R_b: Array) -> tuple[Array, Array]:
    """R_X and R_Y (3, 3) of ``R_a R_Y = R_X R_b`` in the least squares.

    Args:
        R_a: (m, 3, 3) of tracker a in space a.
        R_b: (m, 3, 3) of tracker b in space b at the same times.
    """
    # R_a Y R_b^T = X, row by row: (R_a kron R_b) vec(Y) = vec(X)
    K = np.einsum("nij,nkl->ikjl", R_a, R_b).reshape(9, 9) / len(R_a)
    U, _, Vt = np.linalg.svd(K)
    sign = np.sign(np.linalg.det(U[:, 0].reshape(3, 3)))
    R_Y = rotation_mean(sign * Vt[:1].reshape(1, 3, 3))
    for _ in range(_ROUNDS):  # the nearest rotations to each are not yet the best pair
        R_X = rotation_mean(R_a @ R_Y @ transpose(R_b))
        R_Y = rotation_mean(transpose(R_a) @ R_X @ R_b)
    return R_X, R_Y


def fit_positions(R_a: Array, p_a: Array, p_b_in_a: Array) -> tuple[Array, Array]:
    """p_X and p_Y (3,) of ``p_a + R_a p_Y = R_X p_b + p_X`` in the least squares.

    Args:
        R_a: (m, 3, 3) of tracker a in space a.
        p_a: (m, 3) of tracker a in space a.
        p_b_in_a: (m, 3) R_X p_b.
    """
    d = p_b_in_a - p_a
    R_mean, d_mean = np.mean(R_a, axis=0), np.mean(d, axis=0)
    turned = R_a - R_mean
    p_Y = np.linalg.solve(
        np.einsum("nji,njk->ik", turned, turned), np.einsum("nji,nj->i", turned, d - d_mean)
    )
    return R_mean @ p_Y - d_mean, p_Y


def wobble(R: Array) -> float:
    """By how much rotations (m, 3, 3) turn out of the one axis they turn about most, radians.

    What two spaces have in common is seen by nothing else. Errors dX and dY of the fit leave the
    same residual whenever dX = R dY for all R; the information on them is 1 - s, with s the largest
    singular value of the mean rotation, and s falls from 1 by half of the mean squared angle.
    """
    largest = float(np.linalg.svd(np.mean(R, axis=0), compute_uv=False)[0])
    return math.sqrt(2.0 * max(0.0, 1.0 - largest))
