"""From a trained network to the two files that ship: NAME.onnx and NAME.json.

The graph is a single step of the cell. Matrices are stored as float16 and cast to float32 when the
engine loads them (constant folding), which halves the file; what that costs is measured here.
"""

import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import onnx
import torch

from lobstr_hw.errors import ModelError
from lobstr_hw.lower_body import POSE_SIZE
from lobstr_hw.predictors.weights import NetworkCard, load_network, write_card
from lobstr_hw.training.config import STEPPED_KINDS
from lobstr_hw.training.mirrored import MirrorMean, mirrored_weights
from lobstr_hw.training.network import CONTACT_SIZE, LATENT_SIZE, LobstrNetwork
from lobstr_hw.training.onnx_graph import graph_model, value
from lobstr_hw.training.step_graphs import step_nodes

__all__ = ["ExportError", "export_network", "measure_export", "stored"]

Float32 = npt.NDArray[np.float32]
Stepped = TypeVar("Stepped", LobstrNetwork, MirrorMean)


@dataclass(frozen=True, slots=True)
class ExportError:
    """Largest difference between the exported file and the network, over random steps."""

    pose: float
    contact_logit: float
    hidden: float


def export_network(
    network: LobstrNetwork | MirrorMean, card: NetworkCard, path: Path
) -> ExportError:
    """Write ``path`` (.onnx) and its card beside it, and compare them with the network.

    Returns:
        What float16 storage costs.

    Raises:
        ModelError: this kind of network has no single step.
    """
    if network.kind not in STEPPED_KINDS:
        raise ModelError(
            f"a network of kind {network.kind!r} sees a whole window at once and has no step to "
            f"export. Those of {', '.join(STEPPED_KINDS)} have."
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    onnx.save(_model(network), str(path))
    write_card(path.with_suffix(".json"), card)
    return measure_export(network, path)


def measure_export(
    network: LobstrNetwork | MirrorMean, path: Path, steps: int = 200
) -> ExportError:
    """Run the file and the network side by side, both carrying their own state."""
    exported = load_network(path)
    rng = np.random.default_rng(0)
    x = rng.standard_normal((steps, 16, len(exported.card.input_mean))).astype(np.float32)
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


def stored(network: Stepped) -> Stepped:
    """The network whose matrices are what the file holds: it and the engine say the same."""
    rounded = copy.deepcopy(network)
    with torch.no_grad():
        for parameter in rounded.parameters():
            if parameter.dim() > 1:
                parameter.copy_(parameter.half().float())
    return rounded


def _model(network: LobstrNetwork | MirrorMean) -> onnx.ModelProto:
    if isinstance(network, MirrorMean):
        inner, sides = network.network, 2
        weights = mirrored_weights(_weights(inner))
    else:
        inner, sides = network, 1
        weights = _weights(inner)
    nodes, sizes = step_nodes(inner.kind, inner.state_size, LATENT_SIZE, sides)
    return graph_model(
        "lobstr_step",
        nodes,
        [value("x", "n", len(weights["W_x"])), value("h", "n", network.state_size)],
        [
            value("h_next", "n", network.state_size),
            value("pose", "n", POSE_SIZE),
            value("contact", "n", CONTACT_SIZE),
        ],
        weights,
        [k for k, w in weights.items() if w.ndim > 1],
        sizes,
    )


def _weights(network: LobstrNetwork) -> dict[str, Float32]:
    """Every matrix as (in, out), so that a step is x @ W + b."""
    cell = dict(network.encoder.named_parameters(prefix="cell"))
    if network.kind == "lstm":
        cell = dict(network.encoder.named_parameters())
    tensors: dict[str, Any] = {
        "W_x": cell["cell.weight_ih_l0"].T,
        "b_x": cell["cell.bias_ih_l0"],
        "W_h": cell["cell.weight_hh_l0"].T,
        "b_h": cell["cell.bias_hh_l0"],
        "W_latent": network.latent.weight.T,
        "b_latent": network.latent.bias,
        "W_heads": torch.cat([network.pose.weight, network.contact.weight]).T,
        "b_heads": torch.cat([network.pose.bias + network.output_mean, network.contact.bias]),
    }
    return {k: t.detach().float().contiguous().numpy() for k, t in tensors.items()}
