"""Predictors: a step is a function (see :mod:`lobstr_hw.predictors.predictor`)."""

from pathlib import Path

from lobstr_hw.errors import ModelError
from lobstr_hw.predictors.predictor import Frame, ModelCard, Prediction, Predictor, State

__all__ = [
    "PREDICTOR_NAMES",
    "SHIPPED",
    "SHIPPED_TWO_WAY",
    "SHIPPED_WEIGHTS",
    "Frame",
    "ModelCard",
    "Prediction",
    "Predictor",
    "State",
    "load_predictor",
]

_MODELS = Path(__file__).resolve().parent.parent / "models"
SHIPPED_WEIGHTS = _MODELS / "lobstr.onnx"
SHIPPED_TWO_WAY = _MODELS / "lobstr-two-way.onnx"
"""For recordings only (:mod:`lobstr_hw.predictors.two_way`)."""
SHIPPED = {"lobstr": SHIPPED_WEIGHTS, "lobstr-paper": _MODELS / "lobstr-paper.onnx"}
"""Networks by name: what ships, and the paper's recipe to compare with."""
PREDICTOR_NAMES = (*SHIPPED, "mean_pose", "standing")


def load_predictor(spec: str) -> Predictor:
    """A predictor by name, or from a weights file (NAME.onnx with its NAME.json).

    Raises:
        ModelError: an unknown name; a file that is missing, damaged or disagrees with the code; a
            network for recordings.
    """
    # imported here: the engine takes 0.1 s to load, and callers may only want the types
    from lobstr_hw.predictors.lobstr import Lobstr
    from lobstr_hw.predictors.trivial import mean_pose, standing
    from lobstr_hw.predictors.weights import load_network, read_card

    if spec == "standing":
        return standing()
    if spec == "mean_pose":
        return mean_pose(read_card(SHIPPED_WEIGHTS.with_suffix(".json")))
    if spec in SHIPPED:
        return Lobstr(load_network(SHIPPED[spec]))
    path = SHIPPED_TWO_WAY if spec == SHIPPED_TWO_WAY.stem else Path(spec)
    if path.suffix == ".onnx":
        return Lobstr(load_network(path))
    raise ModelError(
        f"no predictor {spec!r}: give one of {', '.join(PREDICTOR_NAMES)}, or a FILE.onnx."
    )
