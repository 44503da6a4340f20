"""What goes wrong while somebody is calibrated: made on purpose, to see that it is noticed."""

from dataclasses import replace

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    normalize,
    rotation_x,
    rotation_z,
    to_rotation_vector,
)
from lobstr_hw.simulation.footsteps import minimum_jerk
from lobstr_hw.simulation.legs import LEGS, rotations_to_ankles
from lobstr_hw.simulation.t_pose import PoseDeviation
from lobstr_hw.simulation.take import SimulatedTake
from lobstr_hw.skeleton import Joint, forward_kinematics, local_rotations

__all__ = ["any_direction", "arms_off_level", "seated", "slipped", "unseen"]

_SLUMP = np.deg2rad(-8.0)  # who sits tips the pelvis back
_TRUNK = [Joint.SPINE, Joint.CHEST, Joint.UPPER_CHEST]


def arms_off_level(deviation: PoseDeviation, up_rad: tuple[float, float]) -> PoseDeviation:
    """The same pose with the arms raised by so much (negative: hanging), hands with them."""
    turns = [rotation_z(up_rad[0]), rotation_z(-up_rad[1])]
    arms = np.stack([_after(turns[i], deviation.arms[i]) for i in (0, 1)])
    hands = np.stack([_after(turns[i], deviation.hands[i]) for i in (0, 1)])
    return replace(deviation, arms=arms, hands=hands)


def _after(R: Array, vector: Array) -> Array:
    return to_rotation_vector(R @ from_rotation_vector(vector))


def seated(motion: Motion, hips_height: float) -> Motion:
    """The same upper body on a chair, the hips at this height (of 1.0 standing)."""
    p, R = motion.joints()
    hips = np.array(motion.p_hips)
    hips[:, 1] = hips_height + 0.3 * (hips[:, 1] - np.median(hips[:, 1]))
    hips[:, [0, 2]] = np.median(hips[:, [0, 2]], axis=0) + 0.3 * (
        hips[:, [0, 2]] - np.median(hips[:, [0, 2]], axis=0)
    )
    R = np.array(R)
    R[:, 0] = R[:, 0] @ rotation_x(_SLUMP)
    for k, joint in enumerate(_TRUNK):
        R[:, joint] = R[:, joint] @ rotation_x(_SLUMP * (0.5 - 0.25 * k))
    ankles = np.tile(np.median(p[:, LEGS[:, 2]], axis=0), (len(p), 1, 1))
    ankles[..., 2] += 0.35
    like = np.broadcast_to(rotation_x(np.deg2rad(-60.0)), (len(p), 2, 2, 3, 3))
    R[:, LEGS[:, :2]] = rotations_to_ankles(hips, R[:, 0], ankles, like)
    R[:, LEGS[:, 2]] = R[:, LEGS[:, 3]] = np.eye(3)
    R_local = local_rotations(R)
    p_toes = forward_kinematics(R_local, hips)[0][:, LEGS[:, 3]]
    return replace(motion, name="seated", p_hips=hips, R_local=R_local, p_toes=p_toes)


def slipped(
    take: SimulatedTake,
    tracker: int,
    when_s: float,
    *,
    shift: Array | None = None,
    turn: Array | None = None,
    lasts_s: float = 0.15,
) -> SimulatedTake:
    """A tracker (index in FOUR_POINTS) that moves on its joint at some time, and stays there.

    Args:
        take: as it would have been.
        tracker: which.
        when_s: the middle of the move.
        shift: (3,) metres, in the tracker's frame.
        turn: (3,) rotation vector, in the tracker's frame.
        lasts_s: of the move.
    """
    w = minimum_jerk((take.times_s - when_s) / lasts_s + 0.5)[:, None]
    p, R = np.array(take.p), np.array(take.R)
    if shift is not None:
        p[:, tracker] += (R[:, tracker] @ (w * shift)[..., None])[..., 0]
    if turn is not None:
        R[:, tracker] = R[:, tracker] @ from_rotation_vector(w * turn)
    return replace(take, p=p, R=R)


def unseen(take: SimulatedTake, tracker: int) -> SimulatedTake:
    """A tracker that is never seen: its pose stays what it was at the start."""
    p, R, tracked = np.array(take.p), np.array(take.R), np.array(take.tracked)
    p[:, tracker], R[:, tracker], tracked[:, tracker] = p[0, tracker], R[0, tracker], False
    return replace(take, p=p, R=R, tracked=tracked)


def any_direction(rng: np.random.Generator, length: float) -> Array:
    """A vector (3,) of this length."""
    return normalize(rng.normal(size=3)) * length
