"""One step of each recurrent cell as ONNX nodes, from x and the state h to h_next and the heads.

Matrices are (in, out): W_x and W_h hold a cell's gates side by side in torch's order.
"""

from onnx import NodeProto

from lobstr_hw.training.config import NetworkKind
from lobstr_hw.training.onnx_graph import node

__all__ = ["step_nodes"]


def step_nodes(kind: NetworkKind) -> list[NodeProto]:
    """The whole step of a network of a recurrent kind."""
    cell = {"gru": _gru_nodes, "rnn": _rnn_nodes, "lstm": _lstm_nodes}[kind]()
    hidden = "hidden_next" if kind == "lstm" else "h_next"
    return [
        *cell,
        node("Gemm", f"{hidden} W_latent b_latent", "latent_in"),
        node("Relu", "latent_in", "latent"),
        node("Gemm", "latent W_pose b_pose", "pose"),
        node("Gemm", "latent W_contact b_contact", "contact"),
    ]


def _gru_nodes() -> list[NodeProto]:
    """GRU: h' = (1 - z) n + z h, n = tanh(x_n + r (h W + b)_n)."""
    return [
        node("Gemm", "x W_x b_x", "gx"),
        node("Gemm", "h W_h b_h", "gh"),
        node("Split", "gx", "x_r x_z x_n", axis=1),
        node("Split", "gh", "h_r h_z h_n", axis=1),
        node("Add", "x_r h_r", "sum_r"),
        node("Sigmoid", "sum_r", "r"),
        node("Add", "x_z h_z", "sum_z"),
        node("Sigmoid", "sum_z", "z"),
        node("Mul", "r h_n", "reset_n"),
        node("Add", "x_n reset_n", "sum_n"),
        node("Tanh", "sum_n", "new"),
        node("Sub", "one z", "fresh"),
        node("Mul", "fresh new", "from_new"),
        node("Mul", "z h", "from_old"),
        node("Add", "from_new from_old", "h_next"),
    ]


def _rnn_nodes() -> list[NodeProto]:
    """RNN: h' = tanh(x W + b + h W + b)."""
    return [
        node("Gemm", "x W_x b_x", "gx"),
        node("Gemm", "h W_h b_h", "gh"),
        node("Add", "gx gh", "sum"),
        node("Tanh", "sum", "h_next"),
    ]


def _lstm_nodes() -> list[NodeProto]:
    """LSTM: c' = f c + i g, h' = o tanh(c'); the state is [h, c]."""
    return [
        node("Split", "h", "hidden cells", axis=1),
        node("Gemm", "x W_x b_x", "gx"),
        node("Gemm", "hidden W_h b_h", "gh"),
        node("Add", "gx gh", "sum"),
        node("Split", "sum", "sum_i sum_f sum_g sum_o", axis=1),
        node("Sigmoid", "sum_i", "i"),
        node("Sigmoid", "sum_f", "f"),
        node("Tanh", "sum_g", "g"),
        node("Sigmoid", "sum_o", "o"),
        node("Mul", "f cells", "kept"),
        node("Mul", "i g", "written"),
        node("Add", "kept written", "cells_next"),
        node("Tanh", "cells_next", "shown"),
        node("Mul", "o shown", "hidden_next"),
        node("Concat", "hidden_next cells_next", "h_next", axis=1),
    ]
