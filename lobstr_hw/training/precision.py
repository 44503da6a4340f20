"""A network over a chunk of frames, in the precision of the settings."""

from typing import TypeGuard

from torch import Tensor, nn

from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.devices import device_of, precision_of
from lobstr_hw.training.network import LobstrNetwork
from lobstr_hw.training.recurrence import run_gru

__all__ = ["is_fast", "over_chunk"]


def over_chunk(
    network: LobstrNetwork, x: Tensor, hidden: Tensor | None, config: TrainingConfig
) -> tuple[Tensor, Tensor, Tensor]:
    """Pose (n, frames, 48), logits (n, frames, 4) and the last state (1, n, H) of a chunk.

    Args:
        network: on the device of the settings.
        x: (n, frames, inputs), z-scored.
        hidden: (1, n, H), zero when None.
        config: says the precision.
    """
    gru = network.encoder
    hidden = x.new_zeros(1, len(x), network.state_size) if hidden is None else hidden
    if is_fast(gru, config):
        encoded, hidden = run_gru(gru, x, hidden)
        return *network.heads(encoded), hidden
    with precision_of(config):
        pose, logits, hidden = network(x, hidden, last_only=False)
    return pose, logits, hidden


def is_fast(encoder: nn.Module, config: TrainingConfig) -> TypeGuard[nn.GRU]:
    """Whether :mod:`lobstr_hw.training.recurrence` does it: a GRU in bfloat16 on a processor."""
    on_cpu = device_of(config).type == "cpu"
    return config.precision == "bf16" and isinstance(encoder, nn.GRU) and on_cpu
