"""A running mean of the weights: steadier than the last step's, and free.

The share of the new weights is larger in the first steps, so that the random ones of the start are
soon forgotten.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from lobstr_hw.training.checkpoint import Run
from lobstr_hw.training.config import TrainingConfig

__all__ = ["add_to_average", "with_average"]


def add_to_average(run: Run, config: TrainingConfig) -> None:
    """Take the weights after ``run.step`` steps into the mean, if the settings want one."""
    if config.average == 0.0:
        return
    weights = run.network.state_dict()
    if run.average is None:
        run.average = {name: value.clone() for name, value in weights.items()}
    kept = min(config.average, run.step / (run.step + 9.0))
    for name, value in weights.items():
        # what a checkpoint brought lies on the CPU, wherever the network is
        run.average[name].lerp_(value.to(run.average[name].device), 1.0 - kept)


@contextmanager
def with_average(run: Run) -> Iterator[None]:
    """Within it the run's network has the mean weights, if there is a mean."""
    if run.average is None:
        yield
        return
    own = {name: value.clone() for name, value in run.network.state_dict().items()}
    run.network.load_state_dict(run.average)
    try:
        yield
    finally:
        run.network.load_state_dict(own)
