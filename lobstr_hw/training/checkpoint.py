"""A run that can be killed at any moment and goes on as if nothing had happened.

What a step does depends on the seed and the step's number only, so the random state that has to be
kept is one integer. The file holds tensors and numbers, never code (``weights_only``).
"""

import os
import pickle
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from lobstr_hw.errors import ModelError
from lobstr_hw.features import input_size
from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.dataset import Statistics
from lobstr_hw.training.devices import device_of
from lobstr_hw.training.network import LobstrNetwork
from lobstr_hw.training.streams import Position
from lobstr_hw.training.two_way_network import TwoWayNetwork

__all__ = [
    "Carried",
    "Run",
    "finished_weights",
    "load_checkpoint",
    "new_run",
    "save_checkpoint",
]


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """What the recipe ``carried`` takes from one step to the next.

    Attributes:
        hidden: (1, streams, H) after the last chunk.
        taught: (1, streams, sum of 2 H) the teachers' states, of no numbers where there are none.
        position: of the streams.
    """

    hidden: torch.Tensor
    taught: torch.Tensor
    position: Position


@dataclass(slots=True, eq=False)
class Run:
    """A training run in memory.

    Attributes:
        network: being trained.
        optimizer: Adam.
        stats: of the training clips.
        step: steps done.
        wall_s: seconds spent, over all resumed parts.
        curve: one row per step, and per validation (see ``loop.CURVE_COLUMNS``).
        validation: one row per validation.
        carried: state of the streams, in the recipe ``carried``.
        best: weights that were best in validation, where the recipe keeps them.
        average: running mean of the weights, where the configuration wants one.
    """

    network: LobstrNetwork
    optimizer: torch.optim.Adam
    stats: Statistics
    step: int = 0
    wall_s: float = 0.0
    curve: list[list[float]] = field(default_factory=list)
    validation: list[list[float]] = field(default_factory=list)
    carried: Carried | None = None
    best: dict[str, torch.Tensor] | None = None
    average: dict[str, torch.Tensor] | None = None


def new_run(config: TrainingConfig, stats: Statistics) -> Run:
    """Fresh weights from the seed."""
    torch.manual_seed(config.seed)
    network = _network(config, torch.from_numpy(stats.output_mean)).to(device_of(config))
    return Run(network, torch.optim.Adam(network.parameters(), lr=config.learning_rate), stats)


def finished_weights(run: Run) -> dict[str, torch.Tensor]:
    """Those that were best in validation, where the run kept them; else the mean ones, or all."""
    return run.best or run.average or run.network.state_dict()


def _network(config: TrainingConfig, output_mean: torch.Tensor) -> LobstrNetwork:
    if config.recipe == "two-way":
        return TwoWayNetwork(config.hidden_size, output_mean)
    inputs = input_size(config.feature_form)
    return LobstrNetwork(config.hidden_size, output_mean, config.network, inputs, config.window)


def save_checkpoint(path: Path, run: Run) -> None:
    """Write atomically: the old file stays whole until the new one is."""
    document: dict[str, Any] = {
        "network": run.network.state_dict(),
        "optimizer": run.optimizer.state_dict(),
        "stats": {name: torch.from_numpy(getattr(run.stats, name)) for name in _STATS},
        "step": run.step,
        "wall_s": run.wall_s,
        "curve": torch.tensor(run.curve, dtype=torch.float64),
        "validation": torch.tensor(run.validation, dtype=torch.float64),
    }
    if run.carried is not None:
        document["carried"] = _carried_tensors(run.carried)
    if run.best is not None:
        document["best"] = run.best
    if run.average is not None:
        document["average"] = run.average
    partial = path.with_suffix(".partial")
    with partial.open("wb") as file:
        torch.save(document, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(partial, path)


_STATS = ("input_mean", "input_scale", "output_mean", "contact_mean")


def load_checkpoint(path: Path, config: TrainingConfig) -> Run:
    """Go on from a file of :func:`save_checkpoint`.

    Raises:
        ModelError: there is none, or it is damaged or of another configuration.
    """
    try:
        document: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
        stats = Statistics(**{name: document["stats"][name].numpy() for name in _STATS})
        run = new_run(config, stats)
        run.network.load_state_dict(document["network"])
        run.optimizer.load_state_dict(document["optimizer"])
        run.step, run.wall_s = int(document["step"]), float(document["wall_s"])
        run.curve, run.validation = document["curve"].tolist(), document["validation"].tolist()
        run.best, run.average = document.get("best"), document.get("average")
        run.carried = _carried_of(document.get("carried"))
    except FileNotFoundError as error:
        raise ModelError(f"{path}: no checkpoint. Start without --resume.") from error
    except (OSError, RuntimeError, KeyError, ValueError, EOFError, pickle.UnpicklingError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise ModelError(
            f"{path}: not a checkpoint of this configuration ({reason}). "
            "Use the run's own config.json, or start in a new folder."
        ) from error
    return run


def _carried_tensors(carried: Carried) -> dict[str, torch.Tensor]:
    return {
        "hidden": carried.hidden,
        "taught": carried.taught,
        "episode": torch.from_numpy(carried.position.episode),
        "chunk": torch.from_numpy(carried.position.chunk),
    }


def _carried_of(document: dict[str, torch.Tensor] | None) -> Carried | None:
    if document is None:
        return None
    position = Position(document["episode"].numpy(), document["chunk"].numpy())
    return Carried(document["hidden"], document["taught"], position)
