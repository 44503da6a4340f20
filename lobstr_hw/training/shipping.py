"""The card of a finished run, and its export."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from lobstr_hw.errors import ModelError
from lobstr_hw.features import FEATURE_VERSION
from lobstr_hw.predictors.lobstr import GIVES
from lobstr_hw.predictors.predictor import ModelCard
from lobstr_hw.predictors.weights import NetworkCard, write_card
from lobstr_hw.skeleton import SKELETON_VERSION
from lobstr_hw.trackers import FOUR_POINTS
from lobstr_hw.training.checkpoint import Run, finished_weights, load_checkpoint
from lobstr_hw.training.config import Recipe, TrainingConfig, read_config
from lobstr_hw.training.dataset import RATE_HZ
from lobstr_hw.training.export import ExportError, export_network
from lobstr_hw.training.export_two_way import export_two_way
from lobstr_hw.training.loop import VALIDATION_COLUMNS
from lobstr_hw.training.mirrored import MirrorMean, shipped
from lobstr_hw.training.network import LobstrNetwork, parameter_count
from lobstr_hw.training.sources import notices
from lobstr_hw.training.two_way_network import TwoWayNetwork

__all__ = ["export_run", "network_card"]

MODEL_VERSION = "1"
NAMES: dict[Recipe, str] = {
    "carried": "lobstr",
    "paper": "lobstr-paper",
    "two-way": "lobstr-two-way",
}
"""Of the predictor that a recipe's weights make."""


def network_card(run: Run, config: TrainingConfig, details: dict[str, Any]) -> NetworkCard:
    """What the code needs to know of these weights, and what people want to know."""
    model = ModelCard(
        name=NAMES[config.recipe],
        version=MODEL_VERSION,
        rate_hz=RATE_HZ,
        delay_frames=0,
        needs=FOUR_POINTS,
        accepts=FOUR_POINTS,
        gives=GIVES,
        contacts=True,
        feature_version=FEATURE_VERSION,
        skeleton_version=SKELETON_VERSION,
        details=details,
    )
    stats = run.stats
    return NetworkCard(
        model,
        config.feature_form,
        shipped(run.network, config).state_size,
        stats.input_mean,
        stats.input_scale,
        stats.output_mean,
        stats.contact_mean,
        kind="recording" if config.recipe == "two-way" else "live",
    )


def export_run(folder: Path, out: Path, metrics: Mapping[str, Path] | None = None) -> ExportError:
    """Write the weights of a run's newest checkpoint as ``out`` (.onnx) with its card.

    A run that kept the weights that were best in validation gives these, else the mean ones.

    Args:
        folder: of the run.
        out: the ONNX file.
        metrics: name -> a document of lobstr-evaluate, whose totals go on the card.

    Raises:
        ModelError: the folder is no run, or a document cannot be read.
    """
    config = read_config(folder / "config.json")
    # exported on the CPU, wherever it was trained
    run = load_checkpoint(folder / "checkpoint.pt", replace(config, device="cpu"))
    data = _read_json(folder / "data.json")
    run.network.load_state_dict(finished_weights(run))
    details = {
        "recipe": config.recipe,
        "architecture": _architecture(config),
        "parameters": parameter_count(run.network),
        "steps_done": run.step,
        "steps_planned": config.steps,
        "validation": _validation(run),
        "wall_s": round(run.wall_s),
        "data": data,
        "licences": notices(data.get("minutes_by_set", {})),
        "configuration": asdict(config) | {"teachers": _teachers(config)},
        "metrics": {k: _read_json(p).get("all", {}) for k, p in (metrics or {}).items()},
    }
    error = _write(shipped(run.network, config), network_card(run, config, details), out)
    details["float16_storage_error"] = asdict(error)
    write_card(out.with_suffix(".json"), network_card(run, config, details))
    return error


def _write(network: LobstrNetwork | MirrorMean, card: NetworkCard, out: Path) -> ExportError:
    if isinstance(network, TwoWayNetwork):
        return export_two_way(network, card, out)
    return export_network(network, card, out)


def _teachers(config: TrainingConfig) -> list[dict[str, Any]]:
    """Their own settings; where they lay is of no use to anybody else."""
    settings = [asdict(read_config(Path(folder) / "config.json")) for folder in config.teachers]
    return [one | {"teachers": len(one["teachers"])} for one in settings]


def _architecture(config: TrainingConfig) -> str:
    encoder = f"{config.network.upper()} {config.hidden_size}"
    if config.recipe == "two-way":
        encoder = f"two-way {encoder} + {config.hidden_size}"
    mirrored = "; the mean with its mirror image's answer" if config.mirror_mean else ""
    return f"{encoder}, Linear 128 + ReLU, heads 48 and 4{mirrored}"


def _validation(run: Run) -> dict[str, float]:
    """What the run itself measured, of the weights that are exported."""
    if not run.validation:
        return {}
    best = min(run.validation, key=lambda row: row[1])
    row = run.validation[-1] if run.best is None else best
    return {name: round(value, 4) for name, value in zip(VALIDATION_COLUMNS, row, strict=False)}


def _read_json(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise ModelError(
            f"{path}: cannot be read ({error}). A run has a data.json; --metrics takes what "
            "lobstr-evaluate printed."
        ) from error
