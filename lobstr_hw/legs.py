"""Both legs of a tick: the network's pose, the contact lock, the floor, and IK for both."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.contact import ContactLock, LockSettings, follow, release, smoothed, toe_target
from lobstr_hw.floor import FootShape, above_floor, toes_on_floor
from lobstr_hw.ik.jacobian import LegBones, LegPose, solve_legs
from lobstr_hw.ik.vectors import length, rotate, unit
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Body, Joint

__all__ = ["LegBody", "TrackedFeet", "pose_legs"]

UPPER = [Joint.LEFT_UPPER_LEG, Joint.RIGHT_UPPER_LEG]
LOWER = [Joint.LEFT_LOWER_LEG, Joint.RIGHT_LOWER_LEG]
FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]

FOLDED = 0.26
"""Hip to ankle over the leg's length, the knee folded to about 150 degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class LegBody:
    """What the legs need to know of a body in the standard size.

    Attributes:
        hip: upper-leg joints in the hips (n, 2, 3).
        bones: of the legs.
        reach_m: hip joint to toe base, stretched (n, 2).
        shape: of the feet.
    """

    hip: Array
    bones: LegBones
    reach_m: Array
    shape: FootShape

    @staticmethod
    def of(body: Body) -> "LegBody":
        """Of a body in the standard size."""
        bones = LegBones(body.offsets[:, LOWER], body.offsets[:, FEET], body.offsets[:, TOES])
        reach = length(bones.upper) + length(bones.lower) + length(bones.foot)
        return LegBody(body.offsets[:, UPPER], bones, reach[..., 0], FootShape.of(body))


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFeet:
    """Feet that trackers see: ankles (n, 2, 3), rotations (n, 2, 3, 3), which are valid (n, 2)."""

    p: Array
    R: Array
    valid: Bools


def pose_legs(
    body: LegBody,
    lock: ContactLock,
    network: LegPose,
    p_hip: Array,
    contact: Array,
    tracked: TrackedFeet | None,
    dt_s: Array,
    settings: LockSettings,
) -> tuple[ContactLock, LegPose, Array]:
    """The legs to be shown at a tick.

    Args:
        body: sizes.
        lock: state of the contact lock at the last tick.
        network: the legs as predicted, under the measured hips.
        p_hip: upper-leg joints in the world (n, 2, 3).
        contact: probability at the newest grid step (n, 2).
        tracked: feet with trackers of their own, never locked; None where there are no such roles.
        dt_s: time since the last tick (n, 1).
        settings: of the lock.

    Returns:
        The lock's new state, the pose, and the toes' world rotations (n, 2, 3, 3).
    """
    R_foot = network.foot
    lock, toe = smoothed(lock, network.toe(p_hip, body.bones), p_hip, dt_s, settings)
    lock, held = toe_target(lock, toe, dt_s, body.shape.ball_m, settings)
    has_tracker = np.zeros_like(lock.on)
    if tracked is not None:
        has_tracker = tracked.valid
        seen = has_tracker[..., None]
        held = np.where(seen, tracked.p + rotate(tracked.R, body.bones.foot), held)
        R_foot = np.where(seen[..., None], tracked.R, R_foot)
    target, R_foot = above_floor(held, R_foot, body.shape)
    target, crowded = clear_of_hip(target, R_foot, p_hip, body)
    opens = release(lock, held, toe, p_hip, contact, body.reach_m, has_tracker, settings)
    opens |= lock.on & crowded
    lock = follow(lock, target, toe, opens, contact, ~has_tracker, dt_s, settings)
    pose = solve_legs(LegPose(network.upper, network.lower, R_foot), p_hip, body.bones, target)
    reached = pose.toe(p_hip, body.bones)
    return lock, pose, toes_on_floor(reached, pose.foot, body.shape)


def clear_of_hip(toe: Array, R_foot: Array, p_hip: Array, body: LegBody) -> tuple[Array, Bools]:
    """Toe bases moved sideways off the hip joints where a knee cannot fold so far.

    Low over the floor the network's foot may come to be under the hip itself. A knee folds to
    about 150 degrees; nearer than that the foot gives way along the floor.

    Returns:
        toe (n, 2, 3), and which were moved (n, 2).
    """
    v = toe - rotate(R_foot, body.bones.foot) - p_hip
    least = FOLDED * (length(body.bones.upper) + length(body.bones.lower))[..., 0]
    flat = v * np.array([1.0, 0.0, 1.0])
    away = flat + 1e-3 * R_foot[..., :, 2] * np.array([1.0, 0.0, 1.0])
    need = np.sqrt(np.maximum(least**2 - v[..., 1] ** 2, 0.0))
    near = length(flat)[..., 0] < need
    moved = toe + unit(away) * need[..., None] - flat
    return np.where(near[..., None], moved, toe), near
