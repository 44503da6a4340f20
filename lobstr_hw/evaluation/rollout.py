"""Running a predictor over clips: one step per frame (carried), or by the paper's windows."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from lobstr_hw.errors import ModelError
from lobstr_hw.evaluation.truth import Truth, stacked_frame
from lobstr_hw.features import POINT_ROLES, clip_features, clip_points
from lobstr_hw.predictors import Prediction, Predictor
from lobstr_hw.predictors.lobstr import GIVES, Lobstr, prediction_from_6d
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Body
from lobstr_hw.trackers import FOUR_POINTS

__all__ = ["Mode", "Rollout", "groups_of_like_length", "roll_out"]

Mode = Literal["carried", "windowed"]
Float32 = npt.NDArray[np.float32]
Count = Callable[[int], None]

WINDOW = 45
LARGEST_GROUP = 32
LARGEST_BATCH = 512


@dataclass(frozen=True, slots=True, eq=False)
class Rollout:
    """What a predictor said over a clip.

    Attributes:
        R: (frames, 6, 3, 3) legs as the predictor gives them (upper legs in the reference frame).
        C: (frames, 2, 3, 3).
        contact: (frames, 2) probability.
    """

    R: Array
    C: Array
    contact: Array

    @property
    def joints(self) -> Array:
        """C, U, L, F of both sides (frames, 2, 4, 3, 3)."""
        legs = self.R.reshape(-1, 2, 3, 3, 3)
        U = np.swapaxes(self.C, -1, -2) @ legs[:, :, 0]
        return np.concatenate([self.C[:, :, None], U[:, :, None], legs[:, :, 1:]], axis=2)


def roll_out(
    predictor: Predictor, clips: Sequence[Truth], mode: Mode, count: Count = lambda frames: None
) -> list[Rollout]:
    """Run over clips.

    Args:
        predictor: gives the lower body.
        clips: the truth; trackers are made from it without noise.
        mode: ``carried`` is what ships; ``windowed`` starts from zero 45 frames before each frame.
        count: told of frames done.

    Raises:
        ModelError: the predictor cannot be run so.
    """
    if mode == "carried":
        return _carried(predictor, clips, count)
    if not isinstance(predictor, Lobstr):
        raise ModelError(f"{predictor.card.name} has no windowed mode. Use --mode carried.")
    return [_windowed(predictor, clip, count) for clip in clips]


def groups_of_like_length(clips: Sequence[Truth]) -> Iterator[list[int]]:
    """Indices of clips to run side by side: little is wasted on those that end first."""
    order = sorted(range(len(clips)), key=lambda i: -len(clips[i]))
    group: list[int] = []
    for i in order:
        if group and (len(group) == LARGEST_GROUP or len(clips[i]) < 0.7 * len(clips[group[0]])):
            yield group
            group = []
        group.append(i)
    if group:
        yield group


def _carried(predictor: Predictor, clips: Sequence[Truth], count: Count) -> list[Rollout]:
    out: dict[int, Rollout] = {}
    for group in groups_of_like_length(clips):
        members = [clips[i] for i in group]
        said = _run_side_by_side(predictor, members, count)
        for k, i in enumerate(group):
            frames = slice(len(clips[i]))
            out[i] = Rollout(said.R[frames, k], said.C[frames, k], said.contact[frames, k])
    return [out[i] for i in range(len(clips))]


def _run_side_by_side(predictor: Predictor, clips: list[Truth], count: Count) -> Rollout:
    state = predictor.start(Body.standard(len(clips)))
    said: list[Prediction] = []
    for i in range(len(clips[0])):
        state, prediction = predictor.step(state, stacked_frame(clips, i))
        said.append(prediction)
        count(sum(i < len(clip) for clip in clips))
    return Rollout(
        np.stack([p.R for p in said]),
        np.stack([_hip_joints(p, predictor) for p in said]),
        np.stack([p.contact for p in said]),
    )


def _hip_joints(prediction: Prediction, predictor: Predictor) -> Array:
    if prediction.C is None or predictor.card.gives != GIVES:
        raise ModelError(f"{predictor.card.name} does not give the lower body by C, U, L, F.")
    return prediction.C


def _windowed(predictor: Lobstr, clip: Truth, count: Count) -> Rollout:
    z = _network_input(predictor, clip)
    # up to frame 44 the window is what there is of the clip: the same as carrying from zero
    start, contact_start = _run_network(predictor, z[:WINDOW, None])
    poses, logits = [start[:, 0]], [contact_start[:, 0]]
    count(min(len(z), WINDOW))
    for first in range(1, len(z) - WINDOW + 1, LARGEST_BATCH):
        n = min(LARGEST_BATCH, len(z) - WINDOW + 1 - first)
        windows = np.stack([z[first + k : first + k + n] for k in range(WINDOW)])
        pose, contact = _run_network(predictor, windows)
        poses.append(pose[-1])
        logits.append(contact[-1])
        count(n)
    said = prediction_from_6d(np.concatenate(poses), np.concatenate(logits))
    if said.C is None:
        raise AssertionError("the network gives C")
    return Rollout(said.R, said.C, said.contact)


def _network_input(predictor: Lobstr, clip: Truth) -> Float32:
    card = predictor.network.card
    order = [FOUR_POINTS.index(role) for role in POINT_ROLES]
    points = clip_points(clip.p[:, order], clip.R[:, order], form=card.feature_form)
    x = clip_features(points, card.feature_form)
    return np.asarray((x.astype(np.float32) - card.input_mean) / card.input_scale)


def _run_network(predictor: Lobstr, z: Float32) -> tuple[Float32, Float32]:
    """From a zero state over z (frames, n, 37): poses (frames, n, 48), logits (frames, n, 4)."""
    hidden: Float32 = np.zeros((z.shape[1], predictor.network.card.hidden_size), dtype=np.float32)
    poses, logits = [], []
    for x in z:
        hidden, pose, contact = predictor.network.step(np.ascontiguousarray(x), hidden)
        poses.append(pose)
        logits.append(contact)
    return np.stack(poses), np.stack(logits)
