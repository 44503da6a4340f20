"""Hands of somebody else, so that a network does not lean on what one person's arms do.

Arms say less of the legs than pelvis and head, and what they say differs from person to person.
"""

import numpy as np

from lobstr_hw.features import POINT_ROLES
from lobstr_hw.trackers import TrackerRole
from lobstr_hw.training.dataset import Float32

__all__ = ["with_borrowed_hands"]

_HANDS = np.concatenate(
    [
        9 * POINT_ROLES.index(role) + np.arange(9)
        for role in (TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND)
    ]
)
"""Where version 1 of the input has the velocities of both hands."""


def with_borrowed_hands(x: Float32, share: float, rng: np.random.Generator) -> Float32:
    """The input of many streams (streams, frames, 37), in some of them another stream's hands.

    Args:
        x: not changed.
        share: probability of a stream to get them, for all frames given.
        rng: what is drawn depends on it only.
    """
    borrows = rng.random(len(x)) < share
    lender = rng.permutation(len(x))
    out = x.copy()
    out[np.ix_(borrows, np.arange(x.shape[1]), _HANDS)] = x[lender[borrows]][..., _HANDS]
    return out
