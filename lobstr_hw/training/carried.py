"""Training with carried state: truncated back-propagation through time over endless streams.

The state goes from chunk to chunk as it will from frame to frame when a person wears the trackers;
the gradient stops at the chunk's beginning. Validation is over whole clips of people who are not in
training, and the weights that were best there are the ones that are exported.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor, nn

from lobstr_hw.features import clip_features, clip_points, reference_frames
from lobstr_hw.rotations import heading_angle
from lobstr_hw.training.averaging import add_to_average, with_average
from lobstr_hw.training.borrowed_hands import with_borrowed_hands
from lobstr_hw.training.carried_losses import (
    ChunkTargets,
    carried_losses,
    distance,
    toe_errors_in_world,
)
from lobstr_hw.training.checkpoint import Carried, Run
from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.dataset import RATE_HZ, Clips
from lobstr_hw.training.episodes import EpisodeSource
from lobstr_hw.training.kinematics import rotations_from_6d, toes_in_reference
from lobstr_hw.training.mirrored import shipped
from lobstr_hw.training.precision import over_chunk
from lobstr_hw.training.schedule import set_learning_rate
from lobstr_hw.training.streams import Chunk, Position, Streams
from lobstr_hw.training.teachers import Teachers

__all__ = ["WholeClip", "held_out_clips", "keep_best", "train_carried", "validate_carried"]

NOT_SCORED = round(RATE_HZ)
"""Frames at a clip's start, as in the metrics."""


def train_carried(
    run: Run, clips: Clips, validation: Clips | None, config: TrainingConfig
) -> Iterator[Run]:
    """Go on until ``config.steps``, giving the run after each step; it changes in place."""
    teachers = Teachers(config)
    if run.carried is None:
        hidden = torch.zeros(1, config.batch, config.hidden_size)
        taught = torch.zeros(1, config.batch, teachers.state_size)
        run.carried = Carried(hidden, taught, Position.start(config.batch))
    streams = Streams(EpisodeSource(clips, config), config, run.carried.position)
    held_out = [] if validation is None else held_out_clips(validation, run, config)
    while run.step < config.steps:
        run.curve.append(_train_step(run, streams, teachers, config))
        run.step += 1
        add_to_average(run, config)
        due = run.step % config.validate_every == 0 or run.step == config.steps
        if held_out and due:
            with with_average(run):
                figures = validate_carried(shipped(run.network, config), held_out)
                keep_best(run, [float(run.step), *figures])
        yield run


def keep_best(run: Run, row: list[float]) -> None:
    """Note a validation; the weights are kept if no earlier ones had a smaller toe error."""
    if all(row[1] < before[1] for before in run.validation):
        run.best = {name: value.clone() for name, value in run.network.state_dict().items()}
    run.validation.append(row)


def _train_step(
    run: Run, streams: Streams, teachers: Teachers, config: TrainingConfig
) -> list[float]:
    """One chunk of every stream; returns a row of the curve."""
    if run.carried is None:
        raise AssertionError("the state is there from the first step on")
    chunk = streams.next_chunk()
    rate = set_learning_rate(run.optimizer, config, run.step)
    run.network.train()
    goes_on = torch.from_numpy(~chunk.first)[None, :, None]
    seen = with_borrowed_hands(
        chunk.x, config.carried.borrowed_hands, np.random.default_rng([config.seed, run.step])
    )
    x = torch.from_numpy((seen - run.stats.input_mean) / run.stats.input_scale)
    pose, logits, hidden = over_chunk(run.network, x, run.carried.hidden * goes_on, config)
    truth = _targets(chunk, config)
    terms = carried_losses(pose, logits, truth, config.weights)
    total, taught = terms.total, run.carried.taught
    if config.teachers:
        said, sure, taught = teachers.say(chunk.x, taught * goes_on)
        heard = carried_losses(
            pose, logits, replace(truth, pose=said, contact=sure), config.weights
        )
        total = torch.lerp(total, heard.total, config.taught)
    run.optimizer.zero_grad(set_to_none=True)
    total.backward()  # type: ignore[no-untyped-call]
    torch.nn.utils.clip_grad_norm_(run.network.parameters(), config.carried.gradient_norm)
    run.optimizer.step()
    run.carried = Carried(hidden.detach().float(), taught, streams.position)
    values = (total, terms.pose, terms.toe, terms.velocity, terms.contact)
    return [run.step + 1.0, *(float(v.detach()) for v in values), rate]


def _targets(chunk: Chunk, config: TrainingConfig) -> ChunkTargets:
    counted = np.ones(chunk.yaw.shape, dtype=np.float32)
    counted[chunk.first, : config.carried.warm_up] = 0.0
    arrays = (chunk.pose, chunk.contact, chunk.yaw, counted)
    return ChunkTargets(*(torch.from_numpy(a) for a in arrays))


@dataclass(frozen=True, slots=True, eq=False)
class WholeClip:
    """A validation clip: input (frames, 37) z-scored, and the truth."""

    folder: str
    x: Tensor
    pose: Tensor
    contact: Tensor
    yaw: Tensor


def held_out_clips(clips: Clips, run: Run, config: TrainingConfig) -> list[WholeClip]:
    """Undisturbed clips as the network of a run sees them; too short ones are left out."""
    labels = clips.contact if config.contact_label == "floor" else clips.paper_contact
    out = []
    for name, a, b in zip(clips.names, clips.start[:-1], clips.start[1:], strict=True):
        p, R = clips.p[a:b].astype(np.float64), clips.R[a:b].astype(np.float64)
        x = clip_features(clip_points(p, R, form=config.feature_form), config.feature_form).astype(
            np.float32
        )
        yaw = heading_angle(reference_frames(R[:, 0]))[0].astype(np.float32)
        arrays = ((x - run.stats.input_mean) / run.stats.input_scale, clips.pose[a:b], labels[a:b])
        out.append(WholeClip(str(name).split("/")[0], *map(torch.from_numpy, (*arrays, yaw))))
    return [clip for clip in out if len(clip.x) > NOT_SCORED + 1]


def validate_carried(network: nn.Module, clips: list[WholeClip]) -> list[float]:
    """Toe error (cm), rotation error (degrees), contact accuracy, balanced, velocity error (cm/s).

    The state is carried from each clip's start. Folders count alike: the mean of their means.
    """
    network.eval()
    tables: dict[str, list[Tensor]] = {}
    with torch.no_grad():
        for clip in clips:
            tables.setdefault(clip.folder, []).append(_sums(network, clip))
    return torch.stack([_scores(torch.stack(t).sum(0)) for t in tables.values()]).mean(0).tolist()


def _sums(network: nn.Module, clip: WholeClip) -> Tensor:
    """Frames; toe and rotation error; labels on, right on, off, right off; steps; velocity."""
    pose, logits, _ = network(clip.x[None], last_only=False)
    pose, logits = pose[0, NOT_SCORED:], logits[0, NOT_SCORED:]
    truth, contact, yaw = (a[NOT_SCORED:] for a in (clip.pose, clip.contact, clip.yaw))
    errors = toes_in_reference(pose) - toes_in_reference(truth)
    moved = torch.diff(toe_errors_in_world(errors, yaw), dim=0)
    half_sine = (rotations_from_6d(pose) - rotations_from_6d(truth)).flatten(-2).norm(dim=-1)
    angle = 2.0 * torch.asin((half_sine / 8.0**0.5).clamp(max=1.0))
    said = logits.reshape(-1, 2, 2).argmax(-1) > 0
    sums = [
        len(pose),
        distance(errors).mean(-1).sum(),
        angle.mean((-1, -2)).sum(),
        contact.sum(),
        (said & contact).sum(),
        (~contact).sum(),
        (~said & ~contact).sum(),
        len(moved),
        distance(moved).mean(-1).sum(),
    ]
    return torch.tensor([float(value) for value in sums], dtype=torch.float64)


def _scores(sums: Tensor) -> Tensor:
    frames, toe, angle, on, right_on, off, right_off, steps, velocity = sums
    accuracy = (right_on + right_off) / (on + off)
    balanced = 0.5 * (right_on / on.clamp(min=1.0) + right_off / off.clamp(min=1.0))
    toe_cm, speed_cm_s = 100.0 * toe / frames, 100.0 * RATE_HZ * velocity / steps
    return torch.stack([toe_cm, torch.rad2deg(angle / frames), accuracy, balanced, speed_cm_s])
