"""The learning rate of each step."""

import math

import torch

from lobstr_hw.training.config import TrainingConfig

__all__ = ["learning_rate", "set_learning_rate"]

RISING_SHARE = 0.05
"""Of the steps."""
LAST_SHARE = 0.02
"""Of the first rate, where a cosine ends."""


def learning_rate(config: TrainingConfig, step: int) -> float:
    """Of the step after ``step`` steps.

    ``decay`` takes the same factor in every step. ``cosine`` rises in a straight line over the
    first twentieth of the steps, then falls along half a cosine until ``config.steps``: it stays
    high for longer than a decay that ends as low.
    """
    if config.schedule == "decay":
        return config.learning_rate * config.learning_rate_decay**step
    rise = min(1.0, (step + 1) / max(RISING_SHARE * config.steps, 1.0))
    fallen = 0.5 * (1.0 - math.cos(math.pi * step / config.steps))
    return config.learning_rate * rise * (1.0 - (1.0 - LAST_SHARE) * fallen)


def set_learning_rate(optimizer: torch.optim.Optimizer, config: TrainingConfig, step: int) -> float:
    """Give the optimizer the rate of the step after ``step`` steps; returns it."""
    rate = learning_rate(config, step)
    for group in optimizer.param_groups:
        group["lr"] = rate
    return rate
