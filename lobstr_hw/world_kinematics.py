"""Forward kinematics from WORLD rotations in a few array calls (a tick has no time for a loop)."""

import numpy as np

from lobstr_hw.ik.vectors import rotate
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import PARENTS

__all__ = ["positions"]

_PARENTS = np.array(PARENTS[1:])

_ANCESTORS = np.zeros((22, 21))
"""Row j has a one for each bone on the way from the hips to joint j."""
for _joint in range(1, 22):
    _ANCESTORS[_joint] = _ANCESTORS[PARENTS[_joint]]
    _ANCESTORS[_joint, _joint - 1] = 1.0


def positions(R_world: Array, p_hips: Array, offsets: Array) -> Array:
    """Joint positions (n, 22, 3) from world rotations (n, 22, 3, 3), hips (n, 3) and offsets."""
    steps = rotate(R_world[:, _PARENTS], offsets[:, 1:])
    return np.asarray(p_hips[:, None] + _ANCESTORS @ steps)
