"""What turns a window of inputs into hidden numbers: the kinds of the paper's Table 1.

Each takes x (n, frames, inputs) and the state before, and gives (n, frames, H) and the state after.
The recurrent ones can be stepped frame by frame. FC-6 and CNN-1D see a whole window at once: they
have no state (its size is 0) and answer for the window's last frame only. The paper gives no sizes
for these two beyond the hidden 1024; what was chosen is said at each.
"""

import torch
from torch import Tensor, nn

from lobstr_hw.training.config import NetworkKind

__all__ = ["encoder", "state_size"]


def encoder(kind: NetworkKind, inputs: int, hidden_size: int, window: int) -> nn.Module:
    """A fresh one, from torch's global generator.

    Args:
        kind: see the top of the page.
        inputs: numbers of a frame.
        hidden_size: of what comes out.
        window: frames that FC-6 and CNN-1D are made for.
    """
    if kind == "gru":
        return nn.GRU(inputs, hidden_size, batch_first=True)
    if kind == "rnn":
        return nn.RNN(inputs, hidden_size, batch_first=True)
    if kind == "lstm":
        return Lstm(inputs, hidden_size)
    if kind == "fc6":
        return FullyConnected(inputs * window, hidden_size)
    return Convolutions(inputs, hidden_size, window)


def state_size(kind: NetworkKind, hidden_size: int) -> int:
    """Numbers of the state that goes from step to step."""
    return {"gru": hidden_size, "rnn": hidden_size, "lstm": 2 * hidden_size}.get(kind, 0)


class Lstm(nn.Module):
    """Torch's, its hidden numbers and its cells side by side as one state (1, n, 2 H)."""

    def __init__(self, inputs: int, hidden_size: int) -> None:
        super().__init__()
        self.cell = nn.LSTM(inputs, hidden_size, batch_first=True)

    def forward(self, x: Tensor, state: Tensor | None) -> tuple[Tensor, Tensor]:
        before = None
        if state is not None:
            hidden, cells = state.chunk(2, dim=-1)
            before = (hidden.contiguous(), cells.contiguous())
        encoded, after = self.cell(x, before)
        return encoded, torch.cat(after, dim=-1)


class FullyConnected(nn.Module):
    """FC-6: the window as one row, six layers with ReLU.

    The five that keep the size add to what they are given, and the sum keeps its size too: without
    that it learns more slowly (docs/experiments.md).
    """

    def __init__(self, inputs: int, hidden_size: int) -> None:
        super().__init__()
        self.first = nn.Linear(inputs, hidden_size)
        self.others = nn.ModuleList(nn.Linear(hidden_size, hidden_size) for _ in range(5))

    def forward(self, x: Tensor, _: Tensor | None) -> tuple[Tensor, Tensor]:
        hidden = torch.relu(self.first(x.flatten(1)))
        for layer in self.others:
            hidden = 0.5**0.5 * (hidden + torch.relu(layer(hidden)))
        return hidden[:, None], x.new_zeros(1, len(x), 0)


class Convolutions(nn.Module):
    """CNN-1D: three convolutions over 15 frames, each with ReLU and the larger of two frames.

    64, 128 and 256 channels; what is left of the window then goes through one layer with ReLU.
    """

    CHANNELS = (64, 128, 256)
    FRAMES = 15

    def __init__(self, inputs: int, hidden_size: int, window: int) -> None:
        super().__init__()
        sizes = zip((inputs, *self.CHANNELS), self.CHANNELS, strict=False)
        self.convolutions = nn.ModuleList(
            nn.Conv1d(a, b, self.FRAMES, padding=self.FRAMES // 2) for a, b in sizes
        )
        left = window // 2 ** len(self.CHANNELS)
        self.last = nn.Linear(left * self.CHANNELS[-1], hidden_size)

    def forward(self, x: Tensor, _: Tensor | None) -> tuple[Tensor, Tensor]:
        rows = x.transpose(1, 2)
        for convolution in self.convolutions:
            rows = nn.functional.max_pool1d(torch.relu(convolution(rows)), 2)
        return torch.relu(self.last(rows.flatten(1)))[:, None], x.new_zeros(1, len(x), 0)
