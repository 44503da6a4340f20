"""Jacobian IK of the legs: the toe base goes to a target (Yang et al. 2021, section 3.4.1)."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.ik.two_bone import bend_and_swing
from lobstr_hw.ik.vectors import cross, dot, length, rotate, turn
from lobstr_hw.rotations import Array

__all__ = ["LegBones", "LegPose", "solve_legs"]

TOLERANCE_M = 2e-7
DAMPING = 1e-5
"""Squared, in metres: far under the levers' 0.01 to 0.9, so a step in reach is nearly Newton's."""

FOOT_WEIGHT = 0.5
"""Of a turn of the foot against a turn of hip or knee; only stretched legs turn it at all."""

FULL_REACH = 0.995
"""Of the stretched leg's length; beyond it the levers are all but parallel."""

STRAIGHT = 0.998
"""Of the leg's length to the ankle: no leg is stretched further than this by IK alone."""

STEP_LIMIT = 0.5
"""Radians per iteration: the Jacobian is a good guide no further."""


@dataclass(frozen=True, slots=True, eq=False)
class LegBones:
    """Offsets (n, 2, 3): knee in upper leg, ankle in lower leg, toe base in foot."""

    upper: Array
    lower: Array
    foot: Array


@dataclass(frozen=True, slots=True, eq=False)
class LegPose:
    """World rotations (n, 2, 3, 3) of upper leg, lower leg and foot of both sides."""

    upper: Array
    lower: Array
    foot: Array

    def toe(self, p_hip: Array, bones: LegBones) -> Array:
        """Toe base in the world, from the hip joints (n, 2, 3)."""
        ankle = rotate(self.upper, bones.upper) + rotate(self.lower, bones.lower)
        return np.asarray(p_hip + ankle + rotate(self.foot, bones.foot))


def solve_legs(
    pose: LegPose, p_hip: Array, bones: LegBones, target: Array, iterations: int = 8
) -> LegPose:
    """Bring both toe bases to their targets with little change of the pose.

    The closed form (bend the knee, swing the leg, the foot keeps its rotation in the world) meets
    every target that the ankle can follow. Where the leg is too short for that, damped least
    squares over hip (3), knee (1) and foot (3) go on: the heel lifts, as it does on a person. A
    converged leg is left alone, so a batch gives what its members give one by one.

    Args:
        pose: where to start: the network's pose.
        p_hip: upper-leg joints in the world (n, 2, 3).
        bones: lengths.
        target: toe bases wanted (n, 2, 3).
        iterations: of the second part, at most.

    Returns:
        The pose; out of reach, the leg points at the target.
    """
    target = _in_reach(target, p_hip, bones)
    pose = _with_foot_held(pose, p_hip, bones, target)
    for _ in range(iterations):
        error = target - pose.toe(p_hip, bones)
        active = dot(error, error) > TOLERANCE_M**2  # (n, 2, 1)
        if not active.any():
            break
        pose = _step(pose, bones, np.where(active, error, 0.0))
    return pose


def _in_reach(target: Array, p_hip: Array, bones: LegBones) -> Array:
    """Targets (n, 2, 3) no further from the hip than the stretched leg can be, on the same line."""
    line = target - p_hip
    reach = length(bones.upper) + length(bones.lower) + length(bones.foot)
    return p_hip + line * np.minimum(FULL_REACH * reach / np.maximum(length(line), 1e-9), 1.0)


def _with_foot_held(pose: LegPose, p_hip: Array, bones: LegBones, target: Array) -> LegPose:
    to_ankle = target - rotate(pose.foot, bones.foot) - p_hip
    upper, lower = rotate(pose.upper, bones.upper), rotate(pose.lower, bones.lower)
    # near full stretch the knee's bend goes with the square root of what is missing and trembles:
    # the last bit is left to the foot, unless the pose itself is straighter
    most = np.maximum(STRAIGHT * (length(upper) + length(lower)), length(upper + lower))
    to_ankle = to_ankle * np.minimum(most / np.maximum(length(to_ankle), 1e-9), 1.0)
    R_bend, R_swing, _ = bend_and_swing(upper, lower, pose.upper[..., :, 0], to_ankle)
    return LegPose(R_swing @ pose.upper, R_swing @ (R_bend @ pose.lower), pose.foot)


def _step(pose: LegPose, bones: LegBones, error: Array) -> LegPose:
    """One step of damped least squares, dq = W J^T (J W J^T + damping)^-1 error.

    Turns are about world axes, so a joint with all three has the Jacobian -[r]x (r its lever) and
    J J^T = |r|^2 - r r^T; the knee, a hinge, has the single column hinge x r. The foot's turn is
    in the world too: hip and knee move the ankle and leave it as it is.
    """
    knee_lever = rotate(pose.lower, bones.lower)
    hip_lever = rotate(pose.upper, bones.upper) + knee_lever
    foot_lever = rotate(pose.foot, bones.foot)
    hinge = pose.upper[..., :, 0]
    knee = cross(hinge, knee_lever)
    A = _ball(hip_lever) + FOOT_WEIGHT * _ball(foot_lever) + _outer(knee) + DAMPING * np.eye(3)
    y = np.asarray(np.linalg.solve(A, error[..., None])[..., 0], dtype=np.float64)
    turns = np.stack(
        [cross(hip_lever, y), hinge * dot(knee, y), FOOT_WEIGHT * cross(foot_lever, y)], axis=0
    )
    R = turn(turns * np.minimum(STEP_LIMIT / np.maximum(length(turns), 1e-9), 1.0))
    return LegPose(R[0] @ pose.upper, R[0] @ (R[1] @ pose.lower), R[2] @ pose.foot)


def _outer(v: Array) -> Array:
    return np.asarray(v[..., :, None] * v[..., None, :])


def _ball(r: Array) -> Array:
    return np.asarray(dot(r, r)[..., None] * np.eye(3) - _outer(r))
