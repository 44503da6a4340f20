"""What a movement shows of how the trackers are turned in their joints: seen directions.

Each comes with how far off it may be: people hold their heads and hips not quite the same at any
time, and turn their joints about axes that are not quite the anatomist's. These deviations are
those of docs/calibration.md ("Movement"); those of measuring come on top.
"""

import numpy as np

from lobstr_hw.calibration.axes import main_axis
from lobstr_hw.calibration.orientation import Direction, Orientations, believable
from lobstr_hw.calibration.phases import Phases, angular_velocity, rate_of
from lobstr_hw.calibration.recording import RATE_HZ, Movement
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, normalize, transpose

__all__ = ["directions"]

HEAD, LEFT, RIGHT, PELVIS = range(4)
_X, _Y, _Z = np.eye(3)
_FREE = np.inf

UPRIGHT_PELVIS = np.deg2rad([2.0, 0.0, 1.5])
"""Pitch and roll of a pelvis, upright for a few seconds, off what the same person calls straight:
clips of one recorded actor spread by 2.0 and 1.4 (tools/posture_spread.py)."""
UPRIGHT_HEAD = np.deg2rad([2.3, 0.0, 1.8])
WALKING_PELVIS = np.deg2rad(2.6)
"""Yaw against the way: clips of one recorded actor spread by 3.0, whatever they were about."""
WALKING_HEAD = np.deg2rad(2.5)
NOD = np.deg2rad([0.0, 3.8, 3.8])
SHAKE = np.deg2rad([6.0, 0.0, 4.5])
TWIST = np.deg2rad([0.0, 4.5, 4.5])
BEND = np.deg2rad([6.0, 6.0, 0.0])
HAND_TRUST = 1.6
"""Axes of a hand differ from person to person more than from take to take."""

_LEAST_UPRIGHT_S = 1.0
_LEAST_WAY_M = 0.5
_LEAST_TURN = np.deg2rad(40.0)  # back and forth, all together
_FAST = np.deg2rad(50.0)  # per second
_WOBBLE = 0.35  # of a momentary axis that counts in its mean: they are not independent
_SWAY_M = 0.02  # of the hips from side to side, of a few steps


def directions(
    movement: Movement, p: Array, M: Array, phases: Phases, alone: Orientations
) -> tuple[list[Direction], dict[str, bool]]:
    """All that was seen and can be believed, and for each kind whether there was enough of it.

    Args:
        movement: of the trackers.
        p: (m, 4, 3) the joints, roughly.
        M: (4, 3, 3) R_joint_tracker, roughly.
        phases: what was done when.
        alone: what the T-pose says alone.
    """
    groups = {
        "upright": _upright(movement, phases, M),
        "walking": _walking(movement, p, phases),
        "nod": _head_axis(movement, M, phases, _X, NOD),
        "shake": _head_axis(movement, M, phases, _Y, SHAKE),
        "left twist": _hand_axis(movement, p, M, phases, LEFT, _X, TWIST),
        "left bend": _hand_axis(movement, p, M, phases, LEFT, _Z, BEND),
        "right twist": _hand_axis(movement, p, M, phases, RIGHT, _X, TWIST),
        "right bend": _hand_axis(movement, p, M, phases, RIGHT, _Z, BEND),
    }
    groups = {
        name: [direction for direction in group if believable(direction, alone)]
        for name, group in groups.items()
    }
    found = [direction for group in groups.values() for direction in group]
    return found, {name: bool(group) for name, group in groups.items()}


def _deviation(values: Array) -> Array:
    """Zero stands for an axis about which nothing is told."""
    return np.where(values > 0.0, values, _FREE)


def _upright(movement: Movement, phases: Phases, M: Array) -> list[Direction]:
    """Up, where pelvis and head are held upright."""
    found = []
    for joint, spread in ((PELVIS, UPRIGHT_PELVIS), (HEAD, UPRIGHT_HEAD)):
        R = movement.R[:, joint]
        slow = np.linalg.norm(angular_velocity(R, RATE_HZ), axis=-1) < np.deg2rad(60.0)
        chosen = phases.upright & movement.tracked[:, joint]
        if joint == HEAD:
            chosen = chosen & slow
        if np.sum(chosen) >= _LEAST_UPRIGHT_S * RATE_HZ:
            seen = normalize(np.median(R[chosen, 1], axis=0))  # rows are R^T Y
            found.append(Direction(joint, _Y, seen, _deviation(spread)))
    return found


def _walking(movement: Movement, p: Array, phases: Phases) -> list[Direction]:
    """Ahead, where somebody walks straight."""
    tracked = movement.tracked[:, PELVIS] & movement.tracked[:, HEAD]
    velocity = rate_of(p[:, PELVIS], RATE_HZ) * [1.0, 0.0, 1.0]
    chosen = phases.walking & tracked
    way = np.sum(velocity[chosen], axis=0) / RATE_HZ
    walked_m = float(np.linalg.norm(way))
    if walked_m < _LEAST_WAY_M:
        return []
    speed = np.linalg.norm(velocity[chosen], axis=-1)
    found = []
    for joint, spread in ((PELVIS, WALKING_PELVIS), (HEAD, WALKING_HEAD)):
        inside = transpose(movement.R[chosen, joint]) @ normalize(way)
        seen = normalize(np.sum(inside * speed[:, None], axis=0))
        yaw = float(np.hypot(spread, _SWAY_M / walked_m))
        found.append(Direction(joint, _Z, seen, np.array([_FREE, yaw, _FREE])))
    return found


def _head_axis(
    movement: Movement, M: Array, phases: Phases, axis: Array, spread: Array
) -> list[Direction]:
    return _axis(movement, M, HEAD, phases.still, axis, spread)


def _hand_axis(
    movement: Movement,
    p: Array,
    M: Array,
    phases: Phases,
    joint: int,
    axis: Array,
    spread: Array,
) -> list[Direction]:
    speed = np.linalg.norm(rate_of(p[:, joint], RATE_HZ, 0.1), axis=-1)
    fast = np.linalg.norm(angular_velocity(movement.R[:, joint], RATE_HZ), axis=-1)
    near = speed < 0.2 * fast  # metres: the wrist itself hardly moves
    return _axis(movement, M, joint, phases.still & near, axis, spread, HAND_TRUST)


def _axis(
    movement: Movement,
    M: Array,
    joint: int,
    chosen: Bools,
    axis: Array,
    spread: Array,
    trust: float = 1.0,
) -> list[Direction]:
    omega = angular_velocity(movement.R[:, joint], RATE_HZ)
    fast = np.linalg.norm(omega, axis=-1) > _FAST
    chosen = chosen & fast & movement.tracked[:, joint]
    found = main_axis(omega, chosen, M[joint].T @ axis, RATE_HZ)
    if found is None or found.turned_rad < _LEAST_TURN:
        return []
    off = np.where(spread > 0.0, np.hypot(spread, _WOBBLE * found.wobble_rad), 0.0)
    return [Direction(joint, axis, found.seen, _deviation(off), trust)]
