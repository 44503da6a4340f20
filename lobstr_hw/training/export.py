"""From a trained network to the two files that ship: NAME.onnx and NAME.json.

The graph is a single step of the cell. Weights are stored as float16 and cast to float32 when the
engine loads them (constant folding), which halves the file; what that costs is measured here.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

from lobstr_hw.features import INPUT_SIZE
from lobstr_hw.lower_body import POSE_SIZE
from lobstr_hw.predictors.weights import NetworkCard, load_network, write_card
from lobstr_hw.training.network import CONTACT_SIZE, LobstrNetwork

__all__ = ["ExportError", "export_network", "measure_export"]

Float32 = npt.NDArray[np.float32]

OPSET = 17
IR_VERSION = 8
"""Old enough for every onnxruntime this project supports."""


@dataclass(frozen=True, slots=True)
class ExportError:
    """Largest difference between the exported file and the network, over random steps."""

    pose: float
    contact_logit: float
    hidden: float


def export_network(network: LobstrNetwork, card: NetworkCard, path: Path) -> ExportError:
    """Write ``path`` (.onnx) and its card beside it, and compare them with the network.

    Returns:
        What float16 storage costs.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    onnx.save(_model(network), str(path))
    write_card(path.with_suffix(".json"), card)
    return measure_export(network, path)


def measure_export(network: LobstrNetwork, path: Path, steps: int = 200) -> ExportError:
    """Run the file and the network side by side, both carrying their own state."""
    exported = load_network(path)
    rng = np.random.default_rng(0)
    x = rng.standard_normal((steps, 16, INPUT_SIZE)).astype(np.float32)
    h: Float32 = np.zeros((16, exported.card.hidden_size), dtype=np.float32)
    hidden: torch.Tensor | None = None
    worst = np.zeros(3)
    network.eval()
    for x_step in x:
        with torch.no_grad():
            pose, contact, hidden = network(torch.from_numpy(x_step)[:, None], hidden)
        h, pose_file, contact_file = exported.step(x_step, h)
        pairs = ((pose_file, pose), (contact_file, contact), (h, hidden[0]))
        worst = np.maximum(worst, [np.abs(a - b.numpy()).max() for a, b in pairs])
    return ExportError(*(float(w) for w in worst))


def _model(network: LobstrNetwork) -> onnx.ModelProto:
    weights = _weights(network)
    stored = [numpy_helper.from_array(w.astype(np.float16), k + "_16") for k, w in weights.items()]
    casts = [helper.make_node("Cast", [k + "_16"], [k], to=TensorProto.FLOAT) for k in weights]
    hidden = network.gru.hidden_size
    graph = helper.make_graph(
        [*casts, *_cell_nodes()],
        "lobstr_step",
        [_value("x", INPUT_SIZE), _value("h", hidden)],
        [_value("h_next", hidden), _value("pose", POSE_SIZE), _value("contact", CONTACT_SIZE)],
        [*stored, numpy_helper.from_array(np.array(1.0, dtype=np.float32), "one")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)])
    model.ir_version = IR_VERSION
    onnx.checker.check_model(model)
    return model


def _value(name: str, size: int) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", size])


def _weights(network: LobstrNetwork) -> dict[str, Float32]:
    """Every matrix as (in, out), so that a step is x @ W + b."""
    gru = network.gru
    tensors: dict[str, Any] = {
        "W_x": gru.weight_ih_l0.T,
        "b_x": gru.bias_ih_l0,
        "W_h": gru.weight_hh_l0.T,
        "b_h": gru.bias_hh_l0,
        "W_latent": network.latent.weight.T,
        "b_latent": network.latent.bias,
        "W_pose": network.pose.weight.T,
        "b_pose": torch.add(network.pose.bias, network.output_mean),
        "W_contact": network.contact.weight.T,
        "b_contact": network.contact.bias,
    }
    return {k: t.detach().float().contiguous().numpy() for k, t in tensors.items()}


def _cell_nodes() -> list[onnx.NodeProto]:
    """The GRU of torch: h' = (1 - z) n + z h, n = tanh(x_n + r (h W + b)_n)."""

    def node(op: str, inputs: str, outputs: str, **attributes: Any) -> onnx.NodeProto:
        return helper.make_node(op, inputs.split(), outputs.split(), **attributes)

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
        node("Gemm", "h_next W_latent b_latent", "latent_in"),
        node("Relu", "latent_in", "latent"),
        node("Gemm", "latent W_pose b_pose", "pose"),
        node("Gemm", "latent W_contact b_contact", "contact"),
    ]
