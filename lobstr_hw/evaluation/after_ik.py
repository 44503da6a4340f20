"""The body that is shown: the same predictions after lock, floor and IK, on the true root."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobstr_hw.avatar import Avatar
from lobstr_hw.evaluation.rollout import Rollout, groups_of_like_length
from lobstr_hw.evaluation.truth import TOES, Truth, stacked_frame
from lobstr_hw.predictors import Frame, ModelCard, Prediction, State
from lobstr_hw.rotations import Array, transpose
from lobstr_hw.skeleton import Body, Joint

__all__ = ["Shown", "show"]

Bools = npt.NDArray[np.bool_]

_UPPER = (Joint.LEFT_UPPER_LEG, Joint.RIGHT_UPPER_LEG)
_BELOW = ((Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT), (Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT))


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """What the avatar showed over a clip.

    Attributes:
        joints: (frames, 2, 4, 3, 3): C of the network, the U that makes the shown upper leg, L, F.
        p_toes: (frames, 2, 3) in the world.
        locked: (frames, 2).
    """

    joints: Array
    p_toes: Array
    locked: Bools


@dataclass(frozen=True, slots=True, eq=False)
class _Scripted:
    """A predictor that says again what was said before: the network need not run twice."""

    card: ModelCard
    said: Rollout  # (frames, n, ...)

    def start(self, body: Body) -> State:
        return {"frame": np.zeros(len(body.scale), dtype=np.int64)}

    def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
        i = int(state["frame"][0])
        said = self.said
        return {"frame": state["frame"] + 1}, Prediction(said.R[i], said.contact[i], said.C[i])

    def shift_world(self, state: State, T: Array) -> State:
        return state


def show(
    card: ModelCard,
    clips: Sequence[Truth],
    said: Sequence[Rollout],
    count: Callable[[int], None] = lambda frames: None,
) -> list[Shown]:
    """Run the avatar over clips with the predictions that were made for them."""
    out: dict[int, Shown] = {}
    for group in groups_of_like_length(clips):
        members = [clips[i] for i in group]
        script = _Scripted(card, _side_by_side([said[i] for i in group]))
        R_local, p_toes, locked = _run(script, members, count)
        for k, i in enumerate(group):
            frames = slice(len(clips[i]))
            joints = _joints(R_local[frames, k], said[i].C, clips[i].R_ref)
            out[i] = Shown(joints, p_toes[frames, k], locked[frames, k])
    return [out[i] for i in range(len(clips))]


def _side_by_side(said: list[Rollout]) -> Rollout:
    longest = len(said[0].R)

    def stack(values: list[Array]) -> Array:
        held = [np.concatenate([v, np.repeat(v[-1:], longest - len(v), axis=0)]) for v in values]
        return np.stack(held, axis=1)

    return Rollout(
        stack([r.R for r in said]), stack([r.C for r in said]), stack([r.contact for r in said])
    )


def _run(
    script: _Scripted, clips: list[Truth], count: Callable[[int], None]
) -> tuple[Array, Array, Bools]:
    """R_local (frames, n, 22, 3, 3), toes (frames, n, 2, 3), locked (frames, n, 2)."""
    avatar = Avatar(script, Body.standard(len(clips)))
    state = avatar.start()
    R_local, p_toes, locked = [], [], []
    for i in range(len(clips[0])):
        frame = stacked_frame(clips, i)
        state, pose = avatar.step(state, frame, (frame,))
        R_local.append(pose.R_local)
        p_toes.append(pose.p_world[:, TOES])
        locked.append(pose.locked)
        count(sum(i < len(clip) for clip in clips))
    return np.stack(R_local), np.stack(p_toes), np.stack(locked)


def _joints(R_local: Array, C: Array, R_ref: Array) -> Array:
    """The shown legs in the network's terms: U = C^T R_ref^T R_upper_leg."""
    R_upper = R_local[:, Joint.HIPS, None] @ R_local[:, _UPPER]
    U = transpose(C) @ transpose(R_ref)[:, None] @ R_upper
    below = R_local[:, np.array(_BELOW)]  # (frames, 2, 2, 3, 3)
    return np.concatenate([C[:, :, None], U[:, :, None], below], axis=2)
