"""The paper's network (section 3.2): a GRU, a shared layer, and two heads; and its rivals."""

import torch
from torch import Tensor, nn

from lobstr_hw.features import INPUT_SIZE
from lobstr_hw.lower_body import POSE_SIZE
from lobstr_hw.training.config import NetworkKind
from lobstr_hw.training.encoders import encoder, state_size

__all__ = ["LobstrNetwork", "parameter_count"]

LATENT_SIZE = 128
CONTACT_SIZE = 4


class LobstrNetwork(nn.Module):
    """GRU 37 -> hidden, Linear -> 128 + ReLU, Linear -> 48 (8 x 6D) and -> 4 (2 x 2 logits).

    The pose head gives the difference to the mean pose of the training data, which is a buffer here
    and goes into the head's bias on export. Another kind of encoder may stand in the GRU's place.
    """

    output_mean: Tensor

    def __init__(
        self,
        hidden_size: int,
        output_mean: Tensor,
        kind: NetworkKind = "gru",
        inputs: int = INPUT_SIZE,
        window: int = 45,
    ) -> None:
        """Fresh weights from torch's global generator.

        Args:
            hidden_size: 1024 in the paper.
            output_mean: (48,).
            kind: of the encoder.
            inputs: numbers of a frame.
            window: frames, for the kinds that see a window at once.
        """
        super().__init__()
        self.kind = kind
        self.state_size = state_size(kind, hidden_size)
        # under the kind's own name: a checkpoint of another kind does not fit
        self.add_module(kind, encoder(kind, inputs, hidden_size, window))
        self.latent = nn.Linear(hidden_size, LATENT_SIZE)
        self.pose = nn.Linear(LATENT_SIZE, POSE_SIZE)
        self.contact = nn.Linear(LATENT_SIZE, CONTACT_SIZE)
        self.register_buffer("output_mean", output_mean.clone())

    @property
    def encoder(self) -> nn.Module:
        """From inputs to hidden numbers."""
        return self.get_submodule(self.kind)

    def forward(
        self, x: Tensor, hidden: Tensor | None = None, last_only: bool = True
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Run over a window.

        Only the network is on its device (the accelerator, where there is one); what goes in and
        comes out is on that of ``x``, for the losses are small.

        Args:
            x: (n, frames, 37), z-scored.
            hidden: (1, n, H), zero when None.
            last_only: answer for the last frame only.

        Returns:
            pose (n, [frames,] 48), contact logits (n, [frames,] 4), hidden (1, n, H).
        """
        home, here = x.device, self.output_mean.device
        state = None if hidden is None else hidden.to(here)
        encoded, state = self.encoder(x.to(here), state)
        if last_only:
            encoded = encoded[:, -1]
        pose, logits = self.heads(encoded)
        return pose.to(home), logits.to(home), state.to(home)

    def heads(self, encoded: Tensor) -> tuple[Tensor, Tensor]:
        """Pose (..., 48) and contact logits (..., 4) of what the encoder says (..., H)."""
        latent = torch.relu(self.latent(encoded))
        return self.pose(latent).float() + self.output_mean, self.contact(latent).float()


def parameter_count(network: nn.Module) -> int:
    """How many numbers training moves."""
    return sum(p.numel() for p in network.parameters())
