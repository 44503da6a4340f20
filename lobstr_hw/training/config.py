"""Everything a training run depends on besides its data; saved beside the run."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from lobstr_hw.errors import ModelError
from lobstr_hw.features import Form
from lobstr_hw.training.augmentation import Augmentation

__all__ = ["LossWeights", "TrainingConfig", "read_config", "write_config"]


@dataclass(frozen=True, slots=True)
class LossWeights:
    """The paper's lambda 1 to 4."""

    pose: float = 1.0
    toe: float = 0.1
    velocity: float = 0.1
    contact: float = 1e-6


@dataclass(frozen=True, slots=True)
class TrainingConfig:
    """The paper's recipe by default (its appendix 3).

    Attributes:
        steps: the paper's "epochs"; each is one batch, as the authors' code has it.
        batch: windows in a step.
        window: frames in a window, from a zero state; the loss is on the last one.
        hidden_size: of the GRU.
        learning_rate, learning_rate_decay: Adam, and the factor per step.
        seed: of the first weights, the windows and their errors.
        precision: ``bf16`` is three times faster on processors that have it.
        threads: torch's; more than one does not pay on small machines.
        feature_form: ``v1``, or ``paper`` for the tables.
        contact_label: ``floor`` (height over a local floor, and speed), or ``paper`` (1 cm).
        mirror: half of the windows with left and right exchanged.
        validation_windows: drawn once from the validation clips.
        validate_every, checkpoint_every: steps.
    """

    steps: int = 1500
    batch: int = 256
    window: int = 45
    hidden_size: int = 1024
    learning_rate: float = 1e-3
    learning_rate_decay: float = 0.999
    seed: int = 1
    precision: Literal["fp32", "bf16"] = "fp32"
    threads: int = 1
    feature_form: Form = "v1"
    contact_label: Literal["floor", "paper"] = "floor"
    mirror: bool = True
    augmentation: Augmentation = field(default_factory=Augmentation)
    weights: LossWeights = field(default_factory=LossWeights)
    validation_windows: int = 512
    validate_every: int = 50
    checkpoint_every: int = 50


def write_config(path: Path, config: TrainingConfig) -> None:
    """Save as JSON."""
    path.write_text(json.dumps(asdict(config), indent=1) + "\n", encoding="utf-8")


def read_config(path: Path, **changes: Any) -> TrainingConfig:
    """Load what :func:`write_config` wrote; missing keys have their defaults.

    Raises:
        ModelError: it cannot be read, or names something that is no setting.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8")) | changes
        document["augmentation"] = Augmentation(**document.get("augmentation", {}))
        document["weights"] = LossWeights(**document.get("weights", {}))
        return TrainingConfig(**document)
    except (OSError, ValueError, TypeError) as error:
        raise ModelError(
            f"{path}: no training configuration ({error}). "
            "A run's folder has a config.json; --config takes one like it."
        ) from error
