"""How four trackers are turned in their joints: everything that is known about it in one fit.

Unknown are a small turn of each joint and the heading of the T-pose. What is known are directions
(this axis of the joint was seen there, in the tracker's frame) and the T-pose itself, each as good
as its deviation says; the most likely turns follow by Gauss-Newton.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.heading import HANDS_DEVIATION, STRANGE
from lobstr_hw.calibration.priors import HEADSET_DEVIATION, IDEAL_DEVICE, POSE_DEVIATION
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    normalize,
    rotation_y,
    to_rotation_vector,
    transpose,
)

__all__ = ["Direction", "Orientations", "Place", "believable", "fit_orientations"]

_STEPS = 4
_SURPRISE = 3.0  # deviations
_NOTHING = 1e3  # radians: no opinion


@dataclass(frozen=True, slots=True, eq=False)
class Direction:
    """An axis of a joint, seen by its tracker.

    Attributes:
        joint: index in FOUR_POINTS.
        axis: (3,) of the joint, unit.
        seen: (3,) the same in the tracker's frame.
        deviation: (3,) radians about each axis of the joint; infinite where it tells nothing.
        trust: above 1 it weighs as if it were so many times as exact: an axis that one person
            keeps from take to take is worth more to repeats than it is to the truth.
    """

    joint: int
    axis: Array
    seen: Array
    deviation: Array
    trust: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A point of a joint, found by its tracker: its direction from the tracker says how that sits.

    Attributes:
        joint: index in FOUR_POINTS.
        expected: (3,) from the point to the tracker, in the joint's frame, metres.
        found: (3,) the same in the tracker's frame.
        covariance: (3, 3) of the difference, in the joint's frame.
        trust: as of a direction.
    """

    joint: int
    expected: Array
    found: Array
    covariance: Array
    trust: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Orientations:
    """Most likely turns.

    Attributes:
        R_joint_tracker: (4, 3, 3).
        deviation: (4, 3) radians about the axes of each joint.
        heading_rad: of the T-pose.
    """

    R_joint_tracker: Array
    deviation: Array
    heading_rad: float


def fit_orientations(
    R_t_pose: Array, hands_heading_rad: float, evidence: Sequence[Direction | Place]
) -> Orientations:
    """Fit.

    Args:
        R_t_pose: (4, 3, 3) trackers in the T-pose, tracking space.
        hands_heading_rad: yaw that the line between the hands gives.
        evidence: what the movement showed; without any this is the T-pose alone.
    """
    S = rotation_y(-hands_heading_rad) @ R_t_pose
    M, psi = np.array(S), 0.0  # R_joint_tracker of joints held straight
    for _ in range(_STEPS):
        rows = [*_t_pose(S, M, psi), *_headset(M[0]), *(_row(M, seen) for seen in evidence)]
        rows.append((np.array([psi / HANDS_DEVIATION]), _unit(12)[None] / HANDS_DEVIATION))
        trust = [1.0] * (len(rows) - len(evidence) - 1) + [seen.trust for seen in evidence] + [1.0]
        w = np.repeat(np.square(trust), [len(row[0]) for row in rows])
        r = np.concatenate([row[0] for row in rows])
        J = np.concatenate([row[1] for row in rows])
        inverse = np.linalg.inv(J.T @ (w[:, None] * J))
        gain = inverse @ (J.T * w)
        x = -gain @ r
        M = from_rotation_vector(x[:12].reshape(4, 3)) @ M
        psi += float(x[12])
    # r has unit variance whatever the weights are
    deviation = np.linalg.norm(gain, axis=1)[:12].reshape(4, 3)
    return Orientations(M, deviation, hands_heading_rad + psi)


def believable(direction: Direction, alone: Orientations) -> bool:
    """Within three deviations of what the T-pose alone says.

    Beyond that somebody went sideways or looked at the floor: it is another movement than the one
    that was asked for.
    """
    v = normalize(alone.R_joint_tracker[direction.joint] @ direction.seen)
    room = np.hypot(direction.deviation, alone.deviation[direction.joint])
    return bool(np.linalg.norm(np.cross(direction.axis, v) / room) < _SURPRISE)


def _unit(i: int) -> Array:
    return np.asarray(np.eye(13)[i])


def _block(joint: int, values: Array) -> Array:
    """Rows (k, 13) that touch one joint's turn by values (k, 3)."""
    J = np.zeros((len(values), 13))
    J[:, 3 * joint : 3 * joint + 3] = values
    return J


def _t_pose(S: Array, M: Array, psi: float) -> list[tuple[Array, Array]]:
    """Every joint is held nearly straight: log(Ry(-psi) S M^T) is small."""
    held = to_rotation_vector(rotation_y(-psi) @ S @ transpose(M)) / POSE_DEVIATION
    rows = []
    for joint in range(4):
        J = _block(joint, -np.eye(3))
        J[1, 12] = -1.0
        rows.append((held[joint], J / POSE_DEVIATION))
    return rows


def _headset(M: Array) -> list[tuple[Array, Array]]:
    """A headset sits nearly straight; a device that no headset prior fits is left out."""
    off = to_rotation_vector(M @ transpose(IDEAL_DEVICE))
    if np.linalg.norm(off) > STRANGE:
        return []
    return [(off / HEADSET_DEVIATION, _block(0, np.eye(3)) / HEADSET_DEVIATION[:, None])]


def _row(M: Array, seen: Direction | Place) -> tuple[Array, Array]:
    return _seen(M, seen) if isinstance(seen, Direction) else _found(M, seen)


def _found(M: Array, place: Place) -> tuple[Array, Array]:
    """M b - e, whitened; a turn x adds x cross M b."""
    at = M[place.joint] @ place.found
    x, y, z = at
    J = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    white = np.linalg.inv(np.linalg.cholesky(place.covariance))
    return white @ (at - place.expected), _block(place.joint, white @ J)


def _seen(M: Array, d: Direction) -> tuple[Array, Array]:
    """What is left, e x (M b); to first order in a turn x: (e.v) x - v (e.x)."""
    v = normalize(M[d.joint] @ d.seen)
    J = float(d.axis @ v) * np.eye(3) - np.outer(v, d.axis)
    weight = 1.0 / np.minimum(d.deviation, _NOTHING)
    return np.cross(d.axis, v) * weight, _block(d.joint, J * weight[:, None])
