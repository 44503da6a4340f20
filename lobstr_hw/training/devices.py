"""Where the network runs, and in which precision its products are."""

import os
from contextlib import AbstractContextManager

import torch

from lobstr_hw.errors import ModelError
from lobstr_hw.training.config import TrainingConfig

__all__ = ["device_of", "precision_of"]


def device_of(config: TrainingConfig) -> torch.device:
    """The accelerator, if there is one and the settings allow it; each process has its own.

    Raises:
        ModelError: an accelerator is asked for and there is none.
    """
    there = torch.cuda.is_available()
    if config.device == "cuda" and not there:
        raise ModelError("device 'cuda': torch sees no accelerator here. Take --device cpu.")
    if config.device == "cpu" or not there:
        return torch.device("cpu")
    return torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))


def precision_of(config: TrainingConfig) -> AbstractContextManager[object]:
    """Within it the network's products are of the precision that the settings name."""
    kind = device_of(config).type
    return torch.autocast(kind, dtype=torch.bfloat16, enabled=config.precision == "bf16")
