"""Legs of somebody who sits: no network, feet flat on the floor in front of the seat.

The feet stay where they were put until the seat has moved or turned away from them.
"""

from dataclasses import dataclass, replace

import numpy as np

from lobstr_hw.ik.two_bone import limb_rotations, solve_two_bone
from lobstr_hw.ik.vectors import length
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, heading, slerp
from lobstr_hw.skeleton import Body, Joint, global_rotations, local_rotations
from lobstr_hw.skeleton_pose import Mode, SkeletonPose, Source
from lobstr_hw.world_kinematics import positions

__all__ = ["Seat", "sit"]

UPPER = [Joint.LEFT_UPPER_LEG, Joint.RIGHT_UPPER_LEG]
LOWER = [Joint.LEFT_LOWER_LEG, Joint.RIGHT_LOWER_LEG]
FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]

FORWARD = 0.9
"""Of the thigh: the shins stand nearly upright under the knees."""
REACH = 0.98
STAY_M = 0.15
"""Feet follow only when the seat has gone so far."""
ARRIVED_M = 0.005
FOLLOW_M_S = 0.8
TURN_PER_S = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Seat:
    """Where the feet of n people are.

    Attributes:
        ankle: (n, 2, 3) on the floor.
        R_foot: (n, 3, 3) of both.
        moving: (n, 2) on the way to a new place.
    """

    ankle: Array
    R_foot: Array
    moving: Bools


def sit(
    pose: SkeletonPose, body: Body, seat: Seat | None, dt_s: float
) -> tuple[Seat, SkeletonPose]:
    """The same upper body on sitting legs.

    Args:
        pose: of this tick, hips on the seat.
        body: in the user's size.
        seat: of the last tick; None puts the feet down.
        dt_s: since then.
    """
    R = global_rotations(pose.R_local)
    R_ref = heading(R[:, 0], None if seat is None else seat.R_foot)
    p_hip = pose.p_world[:, UPPER]
    seat = _follow(seat, _ankles(p_hip, R_ref, body), R_ref, dt_s)
    thigh, shin = (length(body.offsets[:, bone])[..., 0] for bone in (LOWER, FEET))
    knees_to = (R_ref[:, :, 2] + np.array([0.0, 0.5, 0.0]))[:, None]
    knee = solve_two_bone(p_hip, seat.ankle, thigh, shin, np.broadcast_to(knees_to, p_hip.shape))
    bones = (body.offsets[:, LOWER], body.offsets[:, FEET])
    across = np.broadcast_to(R_ref[:, None, :, 0], p_hip.shape)
    hinge = np.broadcast_to(np.array([1.0, 0.0, 0.0]), p_hip.shape)
    R[:, UPPER], R[:, LOWER] = limb_rotations(p_hip, knee, seat.ankle, bones, hinge, across)
    R[:, FEET] = R[:, TOES] = seat.R_foot[:, None]
    legs = [*UPPER, *LOWER, *FEET, *TOES]
    source = np.array(pose.source)
    source[:, legs] = Source.IK
    on_floor = np.ones_like(pose.contact)
    return seat, replace(
        pose,
        p_world=positions(R, pose.p_world[:, 0], body.offsets),
        R_local=local_rotations(R),
        contact=on_floor,
        locked=on_floor & ~seat.moving,
        source=source,
        mode=Mode.SEATED,
    )


def _ankles(p_hip: Array, R_ref: Array, body: Body) -> Array:
    """Where the ankles (n, 2, 3) should be: in front of the hips, flat feet, in reach."""
    thigh, shin = (length(body.offsets[:, bone])[..., 0] for bone in (LOWER, FEET))
    height = body.sole[:, None] - body.offsets[:, TOES, 1]
    down = p_hip[..., 1] - height
    reach = REACH * (thigh + shin)
    forward = np.minimum(FORWARD * thigh, np.sqrt(np.maximum(reach**2 - down**2, 0.0)))
    ankle = p_hip + forward[..., None] * R_ref[:, None, :, 2]
    ankle[..., 1] = height
    return np.asarray(ankle)


def _follow(seat: Seat | None, wanted: Array, R_ref: Array, dt_s: float) -> Seat:
    if seat is None:
        return Seat(wanted, R_ref, np.zeros(wanted.shape[:2], dtype=bool))
    way = wanted - seat.ankle
    far = length(way)[..., 0]
    moving = (far > STAY_M) | (seat.moving & (far > ARRIVED_M))
    step = np.where(moving, np.minimum(1.0, FOLLOW_M_S * dt_s / np.maximum(far, 1e-9)), 0.0)
    turn = np.where(moving.any(axis=-1), min(1.0, TURN_PER_S * dt_s), 0.0)
    return Seat(seat.ankle + step[..., None] * way, slerp(seat.R_foot, R_ref, turn), moving)
