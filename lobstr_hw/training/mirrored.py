"""A network that also answers for its mirror image, and says the mean of both answers.

One set of weights, two states. At batch 1 a step's time goes into reading the weights, so the
second answer costs little; what it takes away is what one side of the body has learnt by chance.
"""

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt
import torch
from scipy.linalg import block_diag
from torch import Tensor, nn

from lobstr_hw.features import mirror_features
from lobstr_hw.lower_body import POSE_SIZE, mirror_pose_6d
from lobstr_hw.training.config import TrainingConfig
from lobstr_hw.training.network import LobstrNetwork

__all__ = ["MirrorMean", "Step", "both_sides", "mirror_matrices", "mirrored_weights", "shipped"]

Float32 = npt.NDArray[np.float32]

Step = Callable[[Tensor, Tensor | None], tuple[Tensor, Tensor, Tensor]]
"""Input and state -> pose, contact logits and state."""


def mirror_matrices(inputs: int) -> dict[str, Tensor]:
    """What exchanges left and right of a row: x @ M, of the z-scored input, pose and logits.

    The input's mean and scale are those of motions and their mirror images, so that z-scores mirror
    like the features themselves.
    """
    eye = np.eye(4).reshape(4, 2, 2)
    arrays = {
        "mirror_x": mirror_features(np.eye(inputs)),
        "mirror_pose": mirror_pose_6d(np.eye(POSE_SIZE)),
        "mirror_contact": eye[:, ::-1].reshape(4, 4),
    }
    return {name: torch.from_numpy(a.astype(np.float32)) for name, a in arrays.items()}


class MirrorMean(nn.Module):
    """Wraps a network with one state vector; the state is that of both sides, (1, n, 2 H)."""

    def __init__(self, network: LobstrNetwork) -> None:
        """Take a trained network."""
        super().__init__()
        self.network = network
        self.kind = network.kind
        self.state_size = 2 * network.state_size

    def forward(
        self, x: Tensor, hidden: Tensor | None = None, last_only: bool = True
    ) -> tuple[Tensor, Tensor, Tensor]:
        """As :meth:`LobstrNetwork.forward`, with a state (1, n, 2 H)."""

        def step(both: Tensor, state: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
            pose, logits, state = self.network(both, state, last_only)
            return pose, logits, state

        return both_sides(step, x, hidden)


def both_sides(step: Step, x: Tensor, hidden: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
    """The mean of a network's answers for x (n, ...) and its mirror image, and both states."""
    M = mirror_matrices(x.shape[-1])
    n = len(x)
    both = None if hidden is None else torch.cat(hidden.chunk(2, dim=-1), dim=1)
    pose, logits, both = step(torch.cat([x, x @ M["mirror_x"]]), both)
    pose = 0.5 * (pose[:n] + pose[n:] @ M["mirror_pose"])
    logits = 0.5 * (logits[:n] + logits[n:] @ M["mirror_contact"])
    return pose, logits, torch.cat(both.chunk(2, dim=1), dim=-1)


def shipped(network: LobstrNetwork, config: TrainingConfig) -> LobstrNetwork | MirrorMean:
    """What a run's weights are exported and validated as."""
    return MirrorMean(network) if config.mirror_mean else network


def mirrored_weights(weights: Mapping[str, Float32]) -> dict[str, Float32]:
    """The weights of a step for both sides (:mod:`lobstr_hw.training.step_graphs`).

    The mirror images of input and answer are signs and orders, so they go into the matrices: W_x
    makes both sides' rows of one row of x, W_heads the mean answer of both sides' latent numbers.
    """
    M = {name: t.numpy() for name, t in mirror_matrices(len(weights["W_x"])).items()}
    back = block_diag(M["mirror_pose"], M["mirror_contact"]).astype(np.float32)
    W_x, b_x, W, b = (weights[name] for name in ("W_x", "b_x", "W_heads", "b_heads"))
    return {
        **weights,
        "W_x": np.concatenate([W_x, M["mirror_x"] @ W_x], axis=1),
        "b_x": np.tile(b_x, 2),
        "W_heads": 0.5 * np.concatenate([W, W @ back]),
        "b_heads": 0.5 * (b + b @ back),
    }
