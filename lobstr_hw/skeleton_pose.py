"""What the avatar gives out each tick: a whole body in the user's size."""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np
import numpy.typing as npt

from lobstr_hw.rotations import Array
from lobstr_hw.trackers import TrackerRole

__all__ = ["Mode", "RoleReport", "SkeletonPose", "Source"]


class Source(IntEnum):
    """Where a joint's pose comes from."""

    TRACKED = 0
    IK = 1
    PREDICTED = 2
    HELD = 3


class Mode(StrEnum):
    """What the body is doing as a whole."""

    STANDING = "standing"
    SEATED = "seated"
    LYING = "lying"
    AWAY = "away"


@dataclass(frozen=True, slots=True)
class RoleReport:
    """How a role fares at this tick ("ok", "guessed", "missing") and its newest sample's age."""

    state: str
    age_s: float


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonPose:
    """A whole body of n people (leading axis n; live n is 1).

    Attributes:
        time_s: nominal time of the tick.
        p_world: (n, 22, 3) joint positions, the user's metres.
        R_local: (n, 22, 3, 3) each joint in its parent, the hips in the world.
        contact: (n, 2) left and right foot on the floor, as predicted (probability > 0.5).
        locked: (n, 2) held in place by the contact lock.
        source: (n, 22) of :class:`Source`.
        roles: per role, how it fares.
        mode: what the body is doing.
    """

    time_s: float
    p_world: Array
    R_local: Array
    contact: npt.NDArray[np.bool_]
    locked: npt.NDArray[np.bool_]
    source: npt.NDArray[np.int8]
    roles: dict[TrackerRole, RoleReport]
    mode: Mode = Mode.STANDING
