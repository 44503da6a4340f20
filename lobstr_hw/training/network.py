"""The paper's network (section 3.2): a GRU, a shared layer, and two heads."""

import torch
from torch import Tensor, nn

from lobstr_hw.features import INPUT_SIZE
from lobstr_hw.lower_body import POSE_SIZE

__all__ = ["LobstrNetwork", "parameter_count"]

LATENT_SIZE = 128
CONTACT_SIZE = 4


class LobstrNetwork(nn.Module):
    """GRU 37 -> hidden, Linear -> 128 + ReLU, Linear -> 48 (8 x 6D) and -> 4 (2 x 2 logits).

    The pose head gives the difference to the mean pose of the training data, which is a buffer here
    and goes into the head's bias on export.
    """

    output_mean: Tensor

    def __init__(self, hidden_size: int, output_mean: Tensor) -> None:
        """Fresh weights from torch's global generator.

        Args:
            hidden_size: 1024 in the paper.
            output_mean: (48,).
        """
        super().__init__()
        self.gru = nn.GRU(INPUT_SIZE, hidden_size, batch_first=True)
        self.latent = nn.Linear(hidden_size, LATENT_SIZE)
        self.pose = nn.Linear(LATENT_SIZE, POSE_SIZE)
        self.contact = nn.Linear(LATENT_SIZE, CONTACT_SIZE)
        self.register_buffer("output_mean", output_mean.clone())

    def forward(
        self, x: Tensor, hidden: Tensor | None = None, last_only: bool = True
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Run over a window.

        Args:
            x: (n, frames, 37), z-scored.
            hidden: (1, n, H), zero when None.
            last_only: answer for the last frame only.

        Returns:
            pose (n, [frames,] 48), contact logits (n, [frames,] 4), hidden (1, n, H).
        """
        encoded, hidden = self.gru(x, hidden)
        if last_only:
            encoded = encoded[:, -1]
        latent = torch.relu(self.latent(encoded))
        pose = self.pose(latent).float() + self.output_mean
        return pose, self.contact(latent).float(), hidden


def parameter_count(network: nn.Module) -> int:
    """How many numbers training moves."""
    return sum(p.numel() for p in network.parameters())
