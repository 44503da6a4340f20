"""One step of each recurrent cell as ONNX nodes, from x and the state h to h_next and the heads.

Matrices are (in, out): W_x and W_h hold a cell's gates side by side in torch's order, W_heads the
pose and the contacts. At batch 1 a node costs as much as a small product, so there are few.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from onnx import NodeProto

from lobstr_hw.lower_body import POSE_SIZE
from lobstr_hw.training.config import NetworkKind
from lobstr_hw.training.network import CONTACT_SIZE
from lobstr_hw.training.onnx_graph import node

__all__ = ["StepNodes", "step_nodes"]

StepNodes = tuple[list[NodeProto], dict[str, npt.NDArray[Any]]]
"""Nodes, and the constants that they use."""


def step_nodes(kind: NetworkKind, state_size: int, latent: int, sides: int = 1) -> StepNodes:
    """The whole step of a network of a recurrent kind.

    Args:
        kind: of the cell.
        state_size: numbers of a state of one side.
        latent: numbers before the heads.
        sides: 2 where each row of x is two rows to the cell, a body and its mirror image, which
            its weights make of it (:mod:`lobstr_hw.training.mirrored`).
    """
    cell = {"gru": _gru_nodes, "rnn": _rnn_nodes, "lstm": _lstm_nodes}[kind]()
    hidden = "hidden_next" if kind == "lstm" else "state_next"
    gates = {"gru": 3, "rnn": 1, "lstm": 2}[kind] * state_size

    def regroup(rows: str, size: str, as_rows: str) -> NodeProto:
        if sides == 1:
            return node("Identity", rows, as_rows)
        return node("Reshape", f"{rows} {size}", as_rows)

    nodes = [
        node("Gemm", "x W_x b_x", "gx_of_sides"),
        regroup("gx_of_sides", "gate_rows", "gx"),
        regroup("h", "state_rows", "state"),
        *cell,
        node("Gemm", f"{hidden} W_latent b_latent", "latent_in"),
        node("Relu", "latent_in", "latent"),
        regroup("latent", "latent_rows", "latent_of_sides"),
        node("Gemm", "latent_of_sides W_heads b_heads", "heads"),
        node("Split", "heads heads_parts", "pose contact", axis=1),
        regroup("state_next", "side_rows", "h_next"),
    ]
    sizes = {"heads_parts": [POSE_SIZE, CONTACT_SIZE]}
    if kind == "gru":
        sizes["gate_parts"] = [2 * state_size, state_size]
    if sides > 1:
        sizes |= {
            "gate_rows": [-1, gates],
            "state_rows": [-1, state_size],
            "latent_rows": [-1, sides * latent],
            "side_rows": [-1, sides * state_size],
        }
    return nodes, _int64(sizes)


def _int64(sizes: Mapping[str, list[int]]) -> dict[str, npt.NDArray[Any]]:
    return {name: np.array(size, dtype=np.int64) for name, size in sizes.items()}


def _gru_nodes() -> list[NodeProto]:
    """GRU: h' = n + z (h - n), n = tanh(x_n + r (h W + b)_n)."""
    return [
        node("Gemm", "state W_h b_h", "gh"),
        node("Split", "gx gate_parts", "x_rz x_n", axis=1),
        node("Split", "gh gate_parts", "h_rz h_n", axis=1),
        node("Add", "x_rz h_rz", "sum_rz"),
        node("Sigmoid", "sum_rz", "rz"),
        node("Split", "rz", "r z", axis=1),
        node("Mul", "r h_n", "reset_n"),
        node("Add", "x_n reset_n", "sum_n"),
        node("Tanh", "sum_n", "new"),
        node("Sub", "state new", "older"),
        node("Mul", "z older", "kept"),
        node("Add", "new kept", "state_next"),
    ]


def _rnn_nodes() -> list[NodeProto]:
    """RNN: h' = tanh(x W + b + h W + b)."""
    return [
        node("Gemm", "state W_h b_h", "gh"),
        node("Add", "gx gh", "sum"),
        node("Tanh", "sum", "state_next"),
    ]


def _lstm_nodes() -> list[NodeProto]:
    """LSTM: c' = f c + i g, h' = o tanh(c'); the state is [h, c]."""
    return [
        node("Split", "state", "hidden cells", axis=1),
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
        node("Concat", "hidden_next cells_next", "state_next", axis=1),
    ]
