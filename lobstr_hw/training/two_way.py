"""Training of the network for recordings: every frame of a chunk, past and future known.

The chunks are drawn, disturbed and mirrored like the episodes of the recipe ``carried``, each from
a generator of its own: a step depends on the seed and its number only. Frames near a chunk's end
know less than the same frames of a recording that goes on, and have no loss; some ends stand for a
recording's own ends and are scored, for those exist too.
"""

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor, nn

from lobstr_hw.lower_body import POSE_SIZE
from lobstr_hw.predictors.two_way import in_chunks
from lobstr_hw.training.averaging import add_to_average, with_average
from lobstr_hw.training.borrowed_hands import with_borrowed_hands
from lobstr_hw.training.carried import held_out_clips, keep_best, validate_carried
from lobstr_hw.training.carried_losses import (
    ChunkTargets,
    carried_losses,
    distance,
    toe_errors_in_world,
)
from lobstr_hw.training.checkpoint import Run
from lobstr_hw.training.config import TrainingConfig, TwoWaySettings
from lobstr_hw.training.dataset import Clips, Float32
from lobstr_hw.training.devices import precision_of
from lobstr_hw.training.episodes import EpisodeSource
from lobstr_hw.training.kinematics import toes_in_reference
from lobstr_hw.training.mirrored import MirrorMean
from lobstr_hw.training.network import LobstrNetwork
from lobstr_hw.training.precision import is_fast
from lobstr_hw.training.recurrence import run_gru_both_ways
from lobstr_hw.training.schedule import set_learning_rate

__all__ = ["InChunks", "counted_frames", "planted_term", "train_two_way"]

_MARGINS, _HANDS = 2**32 - 1, 2**32 - 2
"""In a chunk's place in the seed: for which ends are scored, and for whose hands are seen."""


def train_two_way(
    run: Run, clips: Clips, validation: Clips | None, config: TrainingConfig
) -> Iterator[Run]:
    """Go on until ``config.steps``, giving the run after each step; it changes in place."""
    source = EpisodeSource(clips, config)
    held_out = [] if validation is None else held_out_clips(validation, run, config)
    while run.step < config.steps:
        run.curve.append(_train_step(run, source, config))
        run.step += 1
        add_to_average(run, config)
        due = run.step % config.validate_every == 0 or run.step == config.steps
        if held_out and due:
            with with_average(run):
                figures = validate_carried(InChunks(run.network), held_out)
                keep_best(run, [float(run.step), *figures])
        yield run


def _train_step(run: Run, source: EpisodeSource, config: TrainingConfig) -> list[float]:
    """One batch of chunks; returns a row of the curve."""
    rate = set_learning_rate(run.optimizer, config, run.step)
    run.network.train()
    x, truth = _batch(source, config, run.step)
    x = with_borrowed_hands(
        x, config.carried.borrowed_hands, np.random.default_rng([config.seed, run.step, _HANDS])
    )
    z = torch.from_numpy((x - run.stats.input_mean) / run.stats.input_scale)
    pose, logits = _through(run.network, z, config)
    terms = carried_losses(pose, logits, truth, config.weights)
    total = terms.total + config.two_way.planted * planted_term(pose, truth)
    run.optimizer.zero_grad(set_to_none=True)
    total.backward()  # type: ignore[no-untyped-call]
    torch.nn.utils.clip_grad_norm_(run.network.parameters(), config.carried.gradient_norm)
    run.optimizer.step()
    values = (total, terms.pose, terms.toe, terms.velocity, terms.contact)
    return [run.step + 1.0, *(float(v.detach()) for v in values), rate]


def _batch(
    source: EpisodeSource, config: TrainingConfig, step: int
) -> tuple[Float32, ChunkTargets]:
    """Input (n, frames, 37) not yet z-scored, and the truth."""
    seeds = ([config.seed, step, i] for i in range(config.batch))
    chunks = [source.draw(np.random.default_rng(seed)) for seed in seeds]
    rng = np.random.default_rng([config.seed, step, _MARGINS])
    counted = counted_frames(config.batch, config.window, config.two_way, rng)
    arrays = [
        np.stack([getattr(chunk, name) for chunk in chunks]) for name in ("pose", "contact", "yaw")
    ]
    truth = ChunkTargets(*(torch.from_numpy(a) for a in (*arrays, counted)))
    return np.stack([chunk.x for chunk in chunks]), truth


def planted_term(pose: Tensor, truth: ChunkTargets) -> Tensor:
    """Mean difference of the true and the said movements per frame of toe bases that stand.

    Args:
        pose: (n, frames, 48) as said.
        truth: of the chunks; a foot stands where it is in contact in both frames.
    """
    errors = toes_in_reference(pose) - toes_in_reference(truth.pose)
    moved = distance(torch.diff(toe_errors_in_world(errors, truth.yaw), dim=1))
    stands = (truth.contact[:, 1:] * truth.contact[:, :-1]) * truth.counted[:, 1:, None]
    return (moved * stands).sum() / stands.sum().clamp(min=1.0)


def counted_frames(
    n: int, frames: int, settings: TwoWaySettings, rng: np.random.Generator
) -> Float32:
    """(n, frames) 1 where there is a loss, else 0."""
    is_end = rng.random((2, n, 1)) < settings.end_share
    margin = np.where(is_end, settings.end_margin, settings.margin)
    frame = np.arange(frames)
    inside = (frame >= margin[0]) & (frames - 1 - frame >= margin[1])
    return np.asarray(inside, dtype=np.float32)


def _through(network: LobstrNetwork, z: Tensor, config: TrainingConfig) -> tuple[Tensor, Tensor]:
    """Pose and logits of chunks, in the precision of the settings; the state is float32."""
    gru = network.encoder
    if is_fast(gru, config):
        return network.heads(run_gru_both_ways(gru, z))
    with precision_of(config):
        pose, logits, _ = network(z, last_only=False)
    return pose, logits


class InChunks(nn.Module):
    """A network over whole clips as it is run over recordings: in chunks, with the mirror image."""

    def __init__(self, network: LobstrNetwork) -> None:
        """Take a network in training."""
        super().__init__()
        self.both = MirrorMean(network)

    def forward(self, z: Tensor, last_only: bool = False) -> tuple[Tensor, Tensor, None]:
        """One clip z (1, frames, 37), z-scored -> pose (1, frames, 48), logits (1, frames, 4)."""

        def ask(chunks: Float32) -> Float32:
            pose, logits, _ = self.both(torch.from_numpy(chunks), last_only=False)
            return np.asarray(torch.cat([pose, logits], dim=-1).numpy())

        said = torch.from_numpy(in_chunks(z[0].numpy(), ask).astype(np.float32))[None]
        return said[..., :POSE_SIZE], said[..., POSE_SIZE:], None
