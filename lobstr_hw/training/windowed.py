"""What a run's network says of the last frame of each window, for kinds that have no step."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch

from lobstr_hw.rotations import Array
from lobstr_hw.training.checkpoint import Run
from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.devices import precision_of

__all__ = ["Outputs", "windowed"]

LARGEST_BATCH = 512


@dataclass(frozen=True, slots=True, eq=False)
class Outputs:
    """Of frames in a row: pose (frames, 48), contact logits (frames, 4)."""

    pose: npt.NDArray[np.float32]
    logits: npt.NDArray[np.float32]


def windowed(run: Run, config: TrainingConfig, x: Array, first: int, end: int) -> Outputs:
    """Run the windows that end in the frames from ``first`` to before ``end``, each from zero.

    The products have the precision that they had in training.

    Args:
        run: whose network is asked.
        config: of the run.
        x: (frames, inputs) of a clip, not yet z-scored.
        first: has a whole window up to it.
        end: after ``first``.
    """
    z = (x[first - config.window + 1 : end] - run.stats.input_mean) / run.stats.input_scale
    windows = torch.from_numpy(z.astype(np.float32)).unfold(0, config.window, 1).transpose(1, 2)
    run.network.eval()
    poses, logits = [], []
    with torch.no_grad(), precision_of(config):
        for batch in torch.split(windows, LARGEST_BATCH):
            pose, contact, _ = run.network(batch.contiguous())
            poses.append(pose)
            logits.append(contact)
    return Outputs(torch.cat(poses).numpy(), torch.cat(logits).numpy())
