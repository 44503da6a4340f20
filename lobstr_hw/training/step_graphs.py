"""One step of each recurrent cell as ONNX nodes, from x and the state h to h_next and the heads.

Matrices are (in, out): W_x and W_h hold a cell's gates side by side in torch's order.
"""

from typing import Any

from onnx import NodeProto, helper

from lobstr_hw.training.config import NetworkKind

__all__ = ["step_nodes"]


def step_nodes(kind: NetworkKind) -> list[NodeProto]:
    """The whole step of a network of a recurrent kind."""
    cell = {"gru": _gru_nodes, "rnn": _rnn_nodes, "lstm": _lstm_nodes}[kind]()
    hidden = "hidden_next" if kind == "lstm" else "h_next"
    return [
        *cell,
        _node("Gemm", f"{hidden} W_latent b_latent", "latent_in"),
        _node("Relu", "latent_in", "latent"),
        _node("Gemm", "latent W_pose b_pose", "pose"),
        _node("Gemm", "latent W_contact b_contact", "contact"),
    ]


def _node(op: str, inputs: str, outputs: str, **attributes: Any) -> NodeProto:
    return helper.make_node(op, inputs.split(), outputs.split(), **attributes)


def _gru_nodes() -> list[NodeProto]:
    """GRU: h' = (1 - z) n + z h, n = tanh(x_n + r (h W + b)_n)."""
    return [
        _node("Gemm", "x W_x b_x", "gx"),
        _node("Gemm", "h W_h b_h", "gh"),
        _node("Split", "gx", "x_r x_z x_n", axis=1),
        _node("Split", "gh", "h_r h_z h_n", axis=1),
        _node("Add", "x_r h_r", "sum_r"),
        _node("Sigmoid", "sum_r", "r"),
        _node("Add", "x_z h_z", "sum_z"),
        _node("Sigmoid", "sum_z", "z"),
        _node("Mul", "r h_n", "reset_n"),
        _node("Add", "x_n reset_n", "sum_n"),
        _node("Tanh", "sum_n", "new"),
        _node("Sub", "one z", "fresh"),
        _node("Mul", "fresh new", "from_new"),
        _node("Mul", "z h", "from_old"),
        _node("Add", "from_new from_old", "h_next"),
    ]


def _rnn_nodes() -> list[NodeProto]:
    """RNN: h' = tanh(x W + b + h W + b)."""
    return [
        _node("Gemm", "x W_x b_x", "gx"),
        _node("Gemm", "h W_h b_h", "gh"),
        _node("Add", "gx gh", "sum"),
        _node("Tanh", "sum", "h_next"),
    ]


def _lstm_nodes() -> list[NodeProto]:
    """LSTM: c' = f c + i g, h' = o tanh(c'); the state is [h, c]."""
    return [
        _node("Split", "h", "hidden cells", axis=1),
        _node("Gemm", "x W_x b_x", "gx"),
        _node("Gemm", "hidden W_h b_h", "gh"),
        _node("Add", "gx gh", "sum"),
        _node("Split", "sum", "sum_i sum_f sum_g sum_o", axis=1),
        _node("Sigmoid", "sum_i", "i"),
        _node("Sigmoid", "sum_f", "f"),
        _node("Tanh", "sum_g", "g"),
        _node("Sigmoid", "sum_o", "o"),
        _node("Mul", "f cells", "kept"),
        _node("Mul", "i g", "written"),
        _node("Add", "kept written", "cells_next"),
        _node("Tanh", "cells_next", "shown"),
        _node("Mul", "o shown", "hidden_next"),
        _node("Concat", "hidden_next cells_next", "h_next", axis=1),
    ]
