"""The two-way network as one graph over all frames: NAME.onnx and NAME.json."""

from pathlib import Path

import numpy as np
import onnx
import torch
from torch import Tensor

from lobstr_hw.features import INPUT_SIZE
from lobstr_hw.lower_body import POSE_SIZE
from lobstr_hw.predictors.two_way import Float32, load_two_way
from lobstr_hw.predictors.weights import NetworkCard, write_card
from lobstr_hw.training.export import ExportError
from lobstr_hw.training.network import CONTACT_SIZE
from lobstr_hw.training.onnx_graph import graph_model, node, value
from lobstr_hw.training.two_way_network import TwoWayNetwork

__all__ = ["export_two_way", "measure_two_way_export"]

_DIRECTIONS = ("", "_reverse")


def export_two_way(network: TwoWayNetwork, card: NetworkCard, path: Path) -> ExportError:
    """Write ``path`` (.onnx) and its card beside it, and compare them with the network.

    Returns:
        What float16 storage costs.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    onnx.save(_model(network), str(path))
    write_card(path.with_suffix(".json"), card)
    return measure_two_way_export(network, path)


def measure_two_way_export(network: TwoWayNetwork, path: Path, frames: int = 200) -> ExportError:
    """Run the file and the network on the same random frames; no state comes out of either."""
    x = np.random.default_rng(0).standard_normal((frames, 4, INPUT_SIZE)).astype(np.float32)
    network.eval()
    with torch.no_grad():
        pose, logits, _ = network(torch.from_numpy(x).transpose(0, 1), last_only=False)
    said = load_two_way(path).session.run(None, {"x": x})
    pairs = zip(said, (pose, logits), strict=True)
    errors = [float(np.abs(a - b.transpose(0, 1).numpy()).max()) for a, b in pairs]
    return ExportError(errors[0], errors[1], 0.0)


def _model(network: TwoWayNetwork) -> onnx.ModelProto:
    weights = _weights(network)
    matrices = [k for k in weights if k.startswith("W_")]
    return graph_model(
        "lobstr_two_way",
        _nodes(network.gru.hidden_size),
        [value("x", "frames", "n", INPUT_SIZE)],
        [value("pose", "frames", "n", POSE_SIZE), value("contact", "frames", "n", CONTACT_SIZE)],
        weights,
        matrices,
        {"frames_n_rest": np.array([0, 0, -1], dtype=np.int64)},
    )


def _weights(network: TwoWayNetwork) -> dict[str, Float32]:
    """The GRU's as the ONNX operator has them, the layers' as (in, out)."""
    gru = dict(network.gru.named_parameters())

    def both(*names: str) -> Tensor:
        rows = [[_zrn(gru[f"{name}_l0{way}"]) for name in names] for way in _DIRECTIONS]
        return torch.stack([torch.cat(row) for row in rows])

    tensors = {
        "W_x": both("weight_ih"),
        "W_h": both("weight_hh"),
        "b": both("bias_ih", "bias_hh"),
        "W_latent": network.latent.weight.T,
        "b_latent": network.latent.bias,
        "W_pose": network.pose.weight.T,
        "b_pose": torch.add(network.pose.bias, network.output_mean),
        "W_contact": network.contact.weight.T,
        "b_contact": network.contact.bias,
    }
    return {k: t.detach().float().contiguous().numpy() for k, t in tensors.items()}


def _zrn(rows: Tensor) -> Tensor:
    """Torch has the gates in the order r, z, n; ONNX as z, r, n."""
    r, z, n = rows.detach().chunk(3)
    return torch.cat([z, r, n])


def _nodes(hidden_size: int) -> list[onnx.NodeProto]:
    gru = {"hidden_size": hidden_size, "direction": "bidirectional", "linear_before_reset": 1}
    return [
        node("GRU", "x W_x W_h b", "ways", **gru),
        node("Transpose", "ways", "side_by_side", perm=[0, 2, 1, 3]),
        node("Reshape", "side_by_side frames_n_rest", "encoded"),
        node("MatMul", "encoded W_latent", "latent_product"),
        node("Add", "latent_product b_latent", "latent_sum"),
        node("Relu", "latent_sum", "latent"),
        node("MatMul", "latent W_pose", "pose_product"),
        node("Add", "pose_product b_pose", "pose"),
        node("MatMul", "latent W_contact", "contact_product"),
        node("Add", "contact_product b_contact", "contact"),
    ]
