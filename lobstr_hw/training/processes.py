"""One training in several processes, as ``torchrun`` starts them.

Every process has the whole network and its own share of each batch, drawn from a seed of its own;
the gradients are averaged, so that all take the same step. The first process validates and writes.
Without ``torchrun`` there is one process, and nothing here does anything.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import torch
import torch.distributed as dist
from torch import Tensor, nn

from lobstr_hw.errors import ModelError
from lobstr_hw.training.checkpoint import Carried
from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.streams import Position

__all__ = ["Processes", "average_gradients", "gathered", "part_of", "processes", "share_of"]

_SEED_APART = 1_000_003
"""Between the seeds of two processes' shares."""


@dataclass(frozen=True, slots=True)
class Processes:
    """How many there are, and which one this is."""

    count: int = 1
    rank: int = 0

    @property
    def first(self) -> bool:
        """Whether this is the one that writes."""
        return self.rank == 0

    def any(self, flag: bool) -> bool:
        """Whether the flag is up in one of them; all must ask at the same time."""
        if self.count == 1:
            return flag
        flags = torch.tensor([float(flag)])
        dist.all_reduce(flags)
        return bool(flags.item() > 0.0)

    @contextmanager
    def one_goes_ahead(self) -> Iterator[None]:
        """What the first process prepares in here, the others find done."""
        if not self.first:
            dist.barrier()
        yield
        if self.first and self.count > 1:
            dist.barrier()


@contextmanager
def processes() -> Iterator[Processes]:
    """Meet the others that ``torchrun`` has started, if it has; part from them at the end."""
    count = int(os.environ.get("WORLD_SIZE", "1"))
    if count == 1:
        yield Processes()
        return
    dist.init_process_group("cpu:gloo,cuda:nccl" if torch.cuda.is_available() else "gloo")
    try:
        yield Processes(count, dist.get_rank())
        dist.barrier()  # who parts while another is still talking to it may end in an abort
    finally:
        dist.destroy_process_group()


def share_of(config: TrainingConfig, who: Processes) -> TrainingConfig:
    """The settings of one process's share of a run.

    Raises:
        ModelError: the batch cannot be shared out evenly.
    """
    if config.batch % who.count:
        raise ModelError(
            f"{who.count} processes cannot share a batch of {config.batch} evenly. "
            "Start a number of processes that divides it."
        )
    seed = config.seed + _SEED_APART * who.rank
    return replace(config, batch=config.batch // who.count, seed=seed)


def average_gradients(network: nn.Module, who: Processes) -> None:
    """From now on every gradient is the mean of all processes' as soon as it is there.

    Autograd goes through the same graph in the same order everywhere, so the processes meet at the
    same gradient.
    """
    if who.count == 1:
        return

    def average(parameter: Tensor) -> None:
        if parameter.grad is not None:
            dist.all_reduce(parameter.grad)
            parameter.grad /= who.count

    for parameter in network.parameters():
        parameter.register_post_accumulate_grad_hook(average)  # type: ignore[no-untyped-call]


def gathered(carried: Carried | None, who: Processes) -> Carried | None:
    """The streams of all processes, those of the first one first; all must ask."""
    if carried is None or who.count == 1:
        return carried
    parts: list[Carried] = [carried] * who.count
    dist.all_gather_object(parts, carried)
    return Carried(
        torch.cat([part.hidden for part in parts], dim=1),
        torch.cat([part.taught for part in parts], dim=1),
        Position(
            np.concatenate([part.position.episode for part in parts]),
            np.concatenate([part.position.chunk for part in parts]),
        ),
    )


def part_of(carried: Carried | None, who: Processes) -> Carried | None:
    """This process's streams of all; the same as before when as many processes go on."""
    if carried is None or who.count == 1:
        return carried
    n = len(carried.position.chunk) // who.count
    mine = slice(who.rank * n, (who.rank + 1) * n)
    position = Position(carried.position.episode[mine], carried.position.chunk[mine])
    return Carried(carried.hidden[:, mine], carried.taught[:, mine], position)
