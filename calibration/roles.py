"""Which tracker stands for which body part: by what it says, or by where it is in a T-pose."""

from collections.abc import Mapping, Sequence

import numpy as np

from lobstr_hw.calibration.heading import headset_heading
from lobstr_hw.errors import MissingRole
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

__all__ = ["assign_roles", "missing_role"]

HEAD, LEFT, RIGHT, PELVIS = FOUR_POINTS


def assign_roles(
    serials: Sequence[str],
    p: Array,
    R: Array,
    hints: Mapping[str, TrackerRole],
) -> dict[TrackerRole, int]:
    """Index of the tracker of each of the four roles.

    Hints are believed. The rest goes by geometry: highest is the head, the widest pair the hands
    (left and right by where the headset looks), nearest under the hands' middle the pelvis.

    Args:
        serials: of the trackers.
        p: (k, 3) positions in a T-pose.
        R: (k, 3, 3) rotations.
        hints: roles that devices claim, by serial.

    Raises:
        MissingRole: fewer trackers than roles.
    """
    found = {
        hints[serial]: i
        for i, serial in reversed(list(enumerate(serials)))  # first come first served
        if hints.get(serial) in FOUR_POINTS
    }
    free = [i for i, serial in enumerate(serials) if serial not in hints]
    if len(free) < len(FOUR_POINTS) - len(found):
        raise missing_role({serial: hints.get(serial) for serial in serials})
    if HEAD not in found:
        found[HEAD] = _take(free, p[free, 1])
    hands = [role for role in (LEFT, RIGHT) if role not in found]
    if len(hands) == 2:
        found |= _hand_pair(free, p, R[found[HEAD]])
    elif hands:
        other = found[LEFT if hands == [RIGHT] else RIGHT]
        found[hands[0]] = _take(free, _level_distance(p[free], p[other]))
    if PELVIS not in found:
        middle = (p[found[LEFT]] + p[found[RIGHT]]) / 2.0
        found[PELVIS] = _take(free, -_level_distance(p[free], middle))
    return {role: found[role] for role in FOUR_POINTS}


def missing_role(seen: Mapping[str, TrackerRole | None]) -> MissingRole:
    """The error that says what was seen and what to do."""
    missing = [role for role in FOUR_POINTS if role not in seen.values()]
    named = ", ".join(f"{role or 'no role'} ({serial})" for serial, role in seen.items())
    return MissingRole(
        f"no tracker for {' and '.join(missing)}; seen: {named or 'no tracker at all'}. A headset, "
        "two controllers and one pelvis tracker are needed: switch the missing one on, see that it "
        "is tracked, and record or calibrate again."
    )


def _take(free: list[int], score: Array) -> int:
    return free.pop(int(np.argmax(score)))


def _level_distance(a: Array, b: Array) -> Array:
    return np.asarray(np.linalg.norm((a - b)[..., [0, 2]], axis=-1))


def _hand_pair(free: list[int], p: Array, R_head: Array) -> dict[TrackerRole, int]:
    """The two free trackers that are farthest apart, left first by the headset's heading."""
    apart = _level_distance(p[free][:, None], p[free][None])
    a, b = np.unravel_index(np.argmax(apart), apart.shape)
    i, j = free[a], free[b]
    yaw = headset_heading(R_head)
    to_left = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
    left, right = (i, j) if (p[i] - p[j]) @ to_left > 0.0 else (j, i)
    free.remove(left)
    free.remove(right)
    return {LEFT: left, RIGHT: right}
