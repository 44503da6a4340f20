"""Weights on disk: NAME.onnx beside its card NAME.json. Never a pickle.

The graph is one step of the network: x (n, 37), h (n, H) -> h', pose (n, 48), contact (n, 4); an
LSTM's h holds its cells too, and the feature forms of tables may have another input size.
Whatever else a step needs (mean, scale, joint order, versions) is on the card. A file that
disagrees with the code is refused with the reason.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np
import numpy.typing as npt
import onnxruntime

from lobstr_hw.errors import ModelError
from lobstr_hw.features import FEATURE_VERSION, Form, input_size
from lobstr_hw.lower_body import JOINT_ORDER, POSE_SIZE
from lobstr_hw.predictors.predictor import ModelCard
from lobstr_hw.skeleton import SKELETON_VERSION, Joint
from lobstr_hw.trackers import TrackerRole

__all__ = [
    "CARD_FORMAT",
    "Kind",
    "Network",
    "NetworkCard",
    "load_network",
    "open_session",
    "read_card",
    "write_card",
]

CARD_FORMAT = 1
Kind = Literal["live", "recording"]
Float32 = npt.NDArray[np.float32]

_CURE = "Use weights made by this version (lobstr-train --export DIR OUT), or the shipped 'lobstr'."


@dataclass(frozen=True, slots=True, eq=False)
class NetworkCard:
    """A model card with what the network's arrays mean.

    Attributes:
        model: what any predictor tells of itself.
        feature_form: of :mod:`lobstr_hw.features`.
        hidden_size: of the state that goes from step to step.
        input_mean, input_scale: (37,) z-scoring of the input; other sizes in the tables' forms.
        output_mean: (48,) mean pose of the training data; the graph has it in its bias.
        contact_mean: (2,) share of the training frames in contact.
        joint_order: of the 48 outputs.
        kind: ``live`` is one step of the cell; ``recording`` needs the frames after it too.
    """

    model: ModelCard
    feature_form: Form
    hidden_size: int
    input_mean: Float32
    input_scale: Float32
    output_mean: Float32
    contact_mean: Float32
    joint_order: tuple[str, ...] = JOINT_ORDER
    kind: Kind = "live"


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """One step of the network, and its card."""

    card: NetworkCard
    session: onnxruntime.InferenceSession

    def step(self, x: Float32, hidden: Float32) -> tuple[Float32, Float32, Float32]:
        """One step: z-scored x (n, 37), hidden (n, H) -> hidden, pose (n, 48), logits (n, 4)."""
        hidden, pose, contact = self.session.run(None, {"x": x, "h": hidden})
        return hidden, pose, contact


def write_card(path: Path, card: NetworkCard) -> None:
    """Write the JSON card."""
    model = card.model
    document = {
        "format": CARD_FORMAT,
        "kind": card.kind,
        "name": model.name,
        "version": model.version,
        "rate_hz": model.rate_hz,
        "delay_frames": model.delay_frames,
        "needs": list(model.needs),
        "accepts": list(model.accepts),
        "gives": [joint.name.lower() for joint in model.gives],
        "contacts": model.contacts,
        "feature_version": model.feature_version,
        "feature_form": card.feature_form,
        "skeleton_version": model.skeleton_version,
        "joint_order": list(card.joint_order),
        "input_size": len(card.input_mean),
        "hidden_size": card.hidden_size,
        "details": model.details,
        "input_mean": _numbers(card.input_mean),
        "input_scale": _numbers(card.input_scale),
        "output_mean": _numbers(card.output_mean),
        "contact_mean": _numbers(card.contact_mean),
    }
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _numbers(values: Float32) -> list[float]:
    return [float(np.format_float_positional(v, unique=True)) for v in values.astype(np.float32)]


def read_card(path: Path) -> NetworkCard:
    """Read and check a JSON card.

    Raises:
        ModelError: it is missing, damaged, or made for another feature or skeleton version.
    """
    document = _read_json(path)
    _check_versions(path, document)
    try:
        form = _form(document["feature_form"])
        return NetworkCard(
            model=_model_card(document),
            feature_form=form,
            hidden_size=int(document["hidden_size"]),
            input_mean=_array(document, "input_mean", input_size(form)),
            input_scale=_array(document, "input_scale", input_size(form)),
            output_mean=_array(document, "output_mean", POSE_SIZE),
            contact_mean=_array(document, "contact_mean", 2),
            joint_order=tuple(document["joint_order"]),
            kind=_kind(document.get("kind", "live")),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ModelError(f"{path}: the card is damaged ({error!r}). {_CURE}") from error


def _read_json(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ModelError(
            f"{path}: the card cannot be read ({error.strerror}). "
            "Weights are two files side by side, NAME.onnx and NAME.json."
        ) from error
    except ValueError as error:
        raise ModelError(f"{path}: the card is no JSON ({error}). {_CURE}") from error
    if not isinstance(document, dict):
        raise ModelError(f"{path}: the card is no JSON object. {_CURE}")
    return document


def _check_versions(path: Path, document: dict[str, Any]) -> None:
    expected = {
        "format": CARD_FORMAT,
        "feature_version": FEATURE_VERSION,
        "skeleton_version": SKELETON_VERSION,
        "input_size": input_size(document.get("feature_form", "v1")),
        "joint_order": list(JOINT_ORDER),
    }
    for key, value in expected.items():
        if document.get(key) != value:
            raise ModelError(
                f"{path}: {key} is {document.get(key)!r}, this code has {value!r}. {_CURE}"
            )


def _model_card(document: dict[str, Any]) -> ModelCard:
    return ModelCard(
        name=str(document["name"]),
        version=str(document["version"]),
        rate_hz=float(document["rate_hz"]),
        delay_frames=int(document["delay_frames"]),
        needs=tuple(TrackerRole(role) for role in document["needs"]),
        accepts=tuple(TrackerRole(role) for role in document["accepts"]),
        gives=tuple(Joint[joint.upper()] for joint in document["gives"]),
        contacts=bool(document["contacts"]),
        feature_version=int(document["feature_version"]),
        skeleton_version=int(document["skeleton_version"]),
        details=dict(document["details"]),
    )


def _form(name: str) -> Form:
    if name not in get_args(Form):
        raise ValueError(f"feature_form {name!r} is none of {', '.join(get_args(Form))}")
    return cast(Form, name)


def _kind(name: str) -> Kind:
    if name not in get_args(Kind):
        raise ValueError(f"kind {name!r} is none of {', '.join(get_args(Kind))}")
    return cast(Kind, name)


def _array(document: dict[str, Any], key: str, size: int) -> Float32:
    values = np.array(document[key], dtype=np.float32)
    if values.shape != (size,) or not np.isfinite(values).all():
        raise ValueError(f"{key} should be {size} numbers")
    return values


def load_network(path: Path, threads: int = 1) -> Network:
    """Open NAME.onnx and the NAME.json beside it.

    Args:
        path: of the ONNX file.
        threads: of the engine; more than one makes a single step slower (measured).

    Raises:
        ModelError: a file is missing or damaged, or disagrees with the code.
    """
    if not path.is_file():
        raise ModelError(f"{path}: no such weights file. Weights are NAME.onnx beside NAME.json.")
    card = read_card(path.with_suffix(".json"))
    if card.kind != "live":
        raise ModelError(
            f"{path}: this network is for recordings, it has to know what comes next. Take it "
            "with lobstr-log export LOG --bvh OUT --refine; live: --predictor lobstr."
        )
    inputs, hidden = len(card.input_mean), card.hidden_size
    state = {"h": hidden, "h_next": hidden}
    session = open_session(path, {"x": inputs, **state, "pose": POSE_SIZE, "contact": 4}, threads)
    return Network(card, session)


def open_session(
    path: Path, expected: dict[str, int], threads: int
) -> onnxruntime.InferenceSession:
    """A graph, checked against the sizes of its inputs' and outputs' last axes.

    Raises:
        ModelError: it is damaged, or another graph than the card says.
    """
    session = _engine(path, threads)
    sizes = {node.name: node.shape[-1] for node in (*session.get_inputs(), *session.get_outputs())}
    if sizes != expected:
        raise ModelError(f"{path}: the graph has {sizes}, the card needs {expected}. {_CURE}")
    return session


def _engine(path: Path, threads: int) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    # a spinning pool thread would burn a core between two steps
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    try:
        return onnxruntime.InferenceSession(
            str(path), sess_options=options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # the engine's exceptions share no base class
        raise ModelError(f"{path}: damaged weights ({_first_line(error)}). {_CURE}") from error


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
