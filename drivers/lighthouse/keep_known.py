"""A new solve in the world that is known already: stations that did not move stay as they are.

Everybody's calibration belongs to a world; a station that was pushed must not take it along.
"""

from collections.abc import Sequence

import numpy as np

from lobstr_hw.drivers.lighthouse.light import Station, Stations
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import rotation_mean, transpose

__all__ = ["keep_known"]


def keep_known(solved: Stations, known: Stations) -> dict[int, Station] | None:
    """All stations in the world of the known ones.

    Args:
        solved: in a world of their own.
        known: those whose place holds.

    Returns:
        None where no station is in both: the worlds cannot be joined.
    """
    both = sorted(set(solved) & set(known))
    if not both:
        return None
    move = _between(
        [known[n].T_world_station for n in both], [solved[n].T_world_station for n in both]
    )
    placed = {n: Station(s.calibration, move @ s.T_world_station) for n, s in solved.items()}
    return placed | dict(known)


def _between(old: Sequence[Pose], new: Sequence[Pose]) -> Pose:
    """Takes the new world to the old one, by the same stations in both."""
    R = rotation_mean(np.stack([a.R @ transpose(b.R) for a, b in zip(old, new, strict=True)]))
    p = np.mean([a.p - R @ b.p for a, b in zip(old, new, strict=True)], axis=0)
    return Pose(R, p)
