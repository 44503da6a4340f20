"""Four points that move evenly, and the same with some of them out of sight for a while."""

from dataclasses import replace

import numpy as np

from lobstr_hw.predictors import Frame
from lobstr_hw.rotations import from_rotation_vector
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

RATE_HZ = 45.0
_START = {
    TrackerRole.HEAD: (0.0, 1.6, 0.1),
    TrackerRole.LEFT_HAND: (0.4, 1.0, 0.3),
    TrackerRole.RIGHT_HAND: (-0.3, 1.2, 0.2),
    TrackerRole.PELVIS: (0.0, 0.9, 0.0),
}


def even_motion(frames: int, turning: TrackerRole, seed: int = 0, n: int = 1) -> list[Frame]:
    """Each point has a speed of its own, and one turns while it goes."""
    rng = np.random.default_rng(seed)
    velocity = 0.4 * rng.standard_normal((n, 4, 3)) / RATE_HZ
    velocity[..., 1] *= 0.1
    turn = np.zeros((n, 4, 3))
    turn[:, FOUR_POINTS.index(turning)] = rng.uniform(-0.7, 0.7, (n, 3)) / RATE_HZ
    start = np.array([_START[role] for role in FOUR_POINTS]) + 0.05 * rng.standard_normal((n, 4, 3))
    R = from_rotation_vector(0.3 * rng.standard_normal((n, 4, 3)))
    ok = np.ones((n, 4), dtype=bool)
    return [
        Frame(
            i / RATE_HZ,
            FOUR_POINTS,
            start + i * velocity,
            from_rotation_vector(i * turn) @ R,
            ok,
            ok,
        )
        for i in range(frames)
    ]


def out_of_sight(
    taken: list[Frame], role: TrackerRole, first: int, end: int, who: int = 0
) -> list[Frame]:
    """The same with one point of one person lost and held, as the live program does."""
    at = FOUR_POINTS.index(role)
    out = list(taken)
    for i in range(first, end):
        p, R, valid = out[i].p.copy(), out[i].R.copy(), out[i].valid_p.copy()
        p[who, at], R[who, at] = out[first - 1].p[who, at], out[first - 1].R[who, at]
        valid[who, at] = False
        out[i] = replace(out[i], p=p, R=R, valid_p=valid, valid_R=valid)
    return out
