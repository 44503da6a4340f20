"""The training loop: one step is a function of the run, the clips and the step's number."""

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from lobstr_hw.training.augmentation import Augmentation
from lobstr_hw.training.carried import train_carried
from lobstr_hw.training.checkpoint import Run
from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.dataset import Clips, Statistics, Windows, draw_windows
from lobstr_hw.training.devices import precision_of
from lobstr_hw.training.kinematics import rotations_from_6d, toes_in_reference
from lobstr_hw.training.losses import Targets, losses
from lobstr_hw.training.schedule import set_learning_rate
from lobstr_hw.training.two_way import train_two_way

__all__ = ["CURVE_COLUMNS", "VALIDATION_COLUMNS", "train", "train_step", "validate"]

CURVE_COLUMNS = ("step", "total", "pose", "toe_m", "velocity_m", "contact", "learning_rate")
VALIDATION_COLUMNS = (
    "step",
    "toe_cm",
    "rotation_deg",
    "contact_accuracy",
    "balanced_accuracy",
    "velocity_cm_s",
)
"""The velocity not in the recipe ``paper``: its windows have one frame each."""

_VALIDATION_STREAM = 2**31
"""A step number no training step has: the validation windows are always the same."""


def train(
    run: Run, clips: Clips, validation: Clips | None, config: TrainingConfig
) -> Iterator[Run]:
    """Go on until ``config.steps``, giving the run after each step; it changes in place."""
    torch.set_num_threads(config.threads)
    if config.recipe == "carried":
        yield from train_carried(run, clips, validation, config)
        return
    if config.recipe == "two-way":
        yield from train_two_way(run, clips, validation, config)
        return
    held_out = _validation_windows(validation, config)
    while run.step < config.steps:
        run.curve.append(train_step(run, clips, config))
        run.step += 1
        due = run.step % config.validate_every == 0 or run.step == config.steps
        if held_out is not None and due:
            run.validation.append([float(run.step), *validate(run, held_out, config)])
        yield run


def train_step(run: Run, clips: Clips, config: TrainingConfig) -> list[float]:
    """One batch; returns a row of the curve."""
    rng = np.random.default_rng([config.seed, run.step])
    windows = draw_windows(clips, config.batch, config, config.augmentation, rng)
    rate = set_learning_rate(run.optimizer, config, run.step)
    run.network.train()
    with precision_of(config):
        pose, logits, _ = run.network(_input(windows, run.stats))
    terms = losses(pose, logits, _targets(windows), config.weights)
    run.optimizer.zero_grad(set_to_none=True)
    terms.total.backward()  # type: ignore[no-untyped-call]
    run.optimizer.step()
    values = (terms.total, terms.pose, terms.toe, terms.velocity, terms.contact)
    return [run.step + 1.0, *(float(v.detach()) for v in values), rate]


def validate(run: Run, windows: Windows, config: TrainingConfig) -> list[float]:
    """Toe error in cm, rotation error over 8 joints in degrees, contact accuracy and balanced."""
    run.network.eval()
    with torch.no_grad(), precision_of(config):
        pose, logits, _ = run.network(_input(windows, run.stats))
    truth = torch.from_numpy(windows.pose)
    toe = (toes_in_reference(pose) - toes_in_reference(truth)).norm(dim=-1).mean()
    difference = rotations_from_6d(pose) - rotations_from_6d(truth)
    half_sine = difference.flatten(-2).norm(dim=-1) / 8.0**0.5
    rotation = 2.0 * torch.asin(half_sine.clamp(max=1.0)).mean()
    said = logits.reshape(-1, 2, 2).argmax(-1).numpy()
    right = said == windows.contact
    recalls = [right[windows.contact == value].mean() for value in np.unique(windows.contact)]
    return [
        100.0 * float(toe),
        float(np.rad2deg(float(rotation))),
        float(right.mean()),
        float(np.mean(recalls)),
    ]


def _validation_windows(clips: Clips | None, config: TrainingConfig) -> Windows | None:
    if clips is None:
        return None
    rng = np.random.default_rng([config.seed, _VALIDATION_STREAM])
    return draw_windows(clips, config.validation_windows, config, Augmentation("none"), rng)


def _input(windows: Windows, stats: Statistics) -> Tensor:
    return torch.from_numpy((windows.x - stats.input_mean) / stats.input_scale)


def _targets(windows: Windows) -> Targets:
    return Targets(
        torch.from_numpy(windows.pose),
        torch.from_numpy(windows.pose_before),
        torch.from_numpy(windows.contact),
    )
