"""Finished runs that a network in training listens to, beside the truth.

The mean of several networks' answers errs less than any of them, above all from frame to frame; a
small network can learn to say that mean, at no cost when it is used. The teachers hear what their
pupil hears, disturbed trackers and all, and carry states of their own.
"""

from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from lobstr_hw.errors import ModelError
from lobstr_hw.training.checkpoint import finished_weights, load_checkpoint
from lobstr_hw.training.config import TrainingConfig, read_config
from lobstr_hw.training.dataset import Float32, Statistics
from lobstr_hw.training.mirrored import both_sides
from lobstr_hw.training.network import LobstrNetwork
from lobstr_hw.training.precision import over_chunk

__all__ = ["Teachers"]


class Teachers:
    """Several networks, each with its mirror image, whose mean is heard."""

    def __init__(self, config: TrainingConfig) -> None:
        """Load the teachers of a pupil; they run on its device and in its precision.

        Raises:
            ModelError: one is no finished run of the recipe ``carried``, or hears something else.
        """
        self._config = config
        self._runs = [_teacher(Path(folder), config) for folder in config.teachers]

    @property
    def state_size(self) -> int:
        """Of all teachers together."""
        return sum(self._sizes())

    @torch.no_grad()
    def say(self, x: Float32, hidden: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Go over a chunk.

        Args:
            x: (n, frames, inputs), not yet z-scored.
            hidden: (1, n, ``state_size``).

        Returns:
            The means of what the teachers say, pose (n, frames, 48) and probability of contact
            (n, frames, 2), and the state after the last frame.
        """
        poses, contacts, after = [], [], []
        states = torch.split(hidden, self._sizes(), dim=-1)
        for (network, stats), state in zip(self._runs, states, strict=True):
            pose, logits, state = self._ask(network, stats, x, state)
            poses.append(pose)
            contacts.append(logits.reshape(*logits.shape[:-1], 2, 2).softmax(-1)[..., 1])
            after.append(state)
        return torch.stack(poses).mean(0), torch.stack(contacts).mean(0), torch.cat(after, dim=-1)

    def _sizes(self) -> list[int]:
        return [2 * network.state_size for network, _ in self._runs]

    def _ask(
        self, network: LobstrNetwork, stats: Statistics, x: Float32, state: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        def step(both: Tensor, hidden: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
            return over_chunk(network, both, hidden, self._config)

        return both_sides(step, torch.from_numpy((x - stats.input_mean) / stats.input_scale), state)


def _teacher(folder: Path, pupil: TrainingConfig) -> tuple[LobstrNetwork, Statistics]:
    config = read_config(folder / "config.json")
    if config.recipe != "carried" or config.feature_form != pupil.feature_form:
        raise ModelError(
            f"{folder} cannot teach: it is of recipe {config.recipe!r} with features "
            f"{config.feature_form!r}. Take runs of --recipe carried with {pupil.feature_form!r}."
        )
    run = load_checkpoint(folder / "checkpoint.pt", replace(config, device=pupil.device))
    if run.step < config.steps:
        raise ModelError(
            f"{folder} cannot teach yet: it is at step {run.step:,} of {config.steps:,}. Finish it "
            f"first: lobstr-train DATA --out {folder} --resume"
        )
    run.network.load_state_dict(finished_weights(run))
    return run.network.eval(), run.stats
