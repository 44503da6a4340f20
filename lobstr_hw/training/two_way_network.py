"""The network for recordings: the same family, but its GRU runs both ways over all frames."""

from torch import Tensor, nn

from lobstr_hw.features import INPUT_SIZE
from lobstr_hw.training.network import LATENT_SIZE, LobstrNetwork

__all__ = ["TwoWayNetwork"]


class TwoWayNetwork(LobstrNetwork):
    """A GRU per direction, both read by the shared layer; the heads are those of the live network.

    Each direction begins from zero at its end of what it is given.
    """

    def __init__(self, hidden_size: int, output_mean: Tensor) -> None:
        """Fresh weights from torch's global generator.

        Args:
            hidden_size: of each direction.
            output_mean: (48,).
        """
        super().__init__(hidden_size, output_mean)
        self.gru = nn.GRU(INPUT_SIZE, hidden_size, batch_first=True, bidirectional=True)
        self.latent = nn.Linear(2 * hidden_size, LATENT_SIZE)
