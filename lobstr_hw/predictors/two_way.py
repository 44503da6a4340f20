"""The network for recordings: every frame's legs from what came before it and what comes after.

A long recording is run in chunks side by side. Where two overlap, each counts for nothing near its
own end, where it knows only one side, and hands over smoothly in between: there is no seam.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnxruntime

from lobstr_hw.errors import ModelError
from lobstr_hw.features import Points, clip_features, mirror_features
from lobstr_hw.ik.vectors import smoothstep
from lobstr_hw.lower_body import POSE_SIZE, mirror_pose_6d
from lobstr_hw.predictors import SHIPPED_TWO_WAY
from lobstr_hw.predictors.predictor import ModelCard
from lobstr_hw.predictors.weights import NetworkCard, open_session, read_card
from lobstr_hw.rotations import Array

__all__ = ["TwoWay", "chunk_starts", "chunk_weights", "in_chunks", "load_two_way"]

Float32 = npt.NDArray[np.float32]

CHUNK = 120
OVERLAP = 80
"""Frames. A chunk is as long as those in training: from longer ones the network says worse
(docs/experiments.md)."""
ALONE = 20
"""Frames at an inner end of a chunk that are left to the neighbour: those that were not scored."""
CHUNKS_AT_ONCE = 64
_OTHER_FOOT = [2, 3, 0, 1]


@dataclass(frozen=True, slots=True, eq=False)
class TwoWay:
    """The exported network: the whole graph over chunks of frames.

    Attributes:
        network: its card.
        session: x (frames, n, 37) -> pose (frames, n, 48), contact (frames, n, 4).
    """

    network: NetworkCard
    session: onnxruntime.InferenceSession

    @property
    def card(self) -> ModelCard:
        """What it needs and gives."""
        return self.network.model

    def say(self, points: Points) -> tuple[Array, Array]:
        """The network's numbers over a recording: pose (frames, 48), logits (frames, 4).

        The recording and its mirror image are asked, and the mean is taken: two answers err less
        than one (docs/experiments.md), and there is time.

        Args:
            points: (frames, 4, ...) at the card's rate, without a gap.
        """
        x = clip_features(points, self.network.feature_form)
        pose, logits = self.forward(x)
        mirrored, mirrored_logits = self.forward(mirror_features(x))
        pose = 0.5 * (pose + mirror_pose_6d(mirrored))
        return pose, 0.5 * (logits + mirrored_logits[:, _OTHER_FOOT])

    def forward(self, x: Array) -> tuple[Array, Array]:
        """Chunk by chunk, once: features (frames, 37), not z-scored -> pose, logits."""

        def ask(chunks: Float32) -> Float32:
            said = self.session.run(None, {"x": np.ascontiguousarray(chunks.swapaxes(0, 1))})
            return np.asarray(np.concatenate(said, axis=-1).swapaxes(0, 1))

        z = (x.astype(np.float32) - self.network.input_mean) / self.network.input_scale
        out = in_chunks(z, ask)
        return out[:, :POSE_SIZE], out[:, POSE_SIZE:]


def in_chunks(z: Float32, ask: Callable[[Float32], Float32]) -> Array:
    """What a network says over a recording of any length, by chunks side by side.

    Args:
        z: (frames, inputs).
        ask: chunks (n, frames of a chunk, inputs) -> (n, frames of a chunk, outputs).
    """
    starts = chunk_starts(len(z))
    length = min(len(z), CHUNK)
    weights = chunk_weights(starts, length, len(z))
    out: Array | None = None
    for first in range(0, len(starts), CHUNKS_AT_ONCE):
        some = starts[first : first + CHUNKS_AT_ONCE]
        said = ask(np.stack([z[a : a + length] for a in some]))
        out = np.zeros((len(z), said.shape[-1])) if out is None else out
        for k, a in enumerate(some):
            out[a : a + length] += weights[first + k][:, None] * said[k]
    if out is None:
        raise AssertionError("there is always a chunk")
    return out


def chunk_starts(frames: int) -> list[int]:
    """Where the chunks of a recording begin; the last one ends with it."""
    if frames <= CHUNK:
        return [0]
    return [*range(0, frames - CHUNK, CHUNK - OVERLAP), frames - CHUNK]


def chunk_weights(starts: list[int], length: int, frames: int) -> Array:
    """How much each chunk counts in its frames (chunks, length); over a frame they add up to 1."""
    at = np.arange(length, dtype=np.float64)
    weights = np.ones((len(starts), length))
    for k, start in enumerate(starts):
        if start > 0:
            weights[k] *= smoothstep(at, ALONE, OVERLAP - ALONE)
        if start + length < frames:
            weights[k] *= smoothstep(length - 1.0 - at, ALONE, OVERLAP - ALONE)
    total = np.zeros(frames)
    for start, row in zip(starts, weights, strict=True):
        total[start : start + length] += row
    return np.stack([row / total[a : a + length] for a, row in zip(starts, weights, strict=True)])


def load_two_way(path: Path = SHIPPED_TWO_WAY, threads: int = 1) -> TwoWay:
    """Open NAME.onnx and the NAME.json beside it.

    Raises:
        ModelError: a file is missing or damaged, disagrees with the code, or is a live network.
    """
    if not path.is_file():
        raise ModelError(f"{path}: no such weights file. Weights are NAME.onnx beside NAME.json.")
    card = read_card(path.with_suffix(".json"))
    if card.kind != "recording":
        raise ModelError(
            f"{path}: '{card.model.name}' is a live network, which sees "
            "no future. Take the shipped lobstr-two-way, or weights of --recipe two-way."
        )
    sizes = {"x": len(card.input_mean), "pose": POSE_SIZE, "contact": 4}
    return TwoWay(card, open_session(path, sizes, threads))
