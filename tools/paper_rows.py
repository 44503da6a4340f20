"""The networks of the paper's tables: their settings, their training, and their runs' folders."""

import csv
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

from lobstr_hw.training.checkpoint import Run, load_checkpoint
from lobstr_hw.training.config import (
    LossWeights,
    TrainingConfig,
    read_config,
    recipe_config,
    write_config,
)

BASE = recipe_config("paper", precision="bf16")
"""The paper's recipe: 1,500 steps, a rate that falls to 0.999 of itself in each."""

SETTINGS: dict[str, TrainingConfig] = {
    "gru": BASE,
    "fc6": replace(BASE, network="fc6"),
    "cnn1d": replace(BASE, network="cnn1d"),
    "rnn": replace(BASE, network="rnn"),
    "lstm": replace(BASE, network="lstm"),
    "gru-p": replace(BASE, weights=LossWeights(toe=0.0, velocity=0.0)),
    "gru-pk": replace(BASE, weights=LossWeights(velocity=0.0)),
    "gru-paper": replace(BASE, feature_form="paper"),
    "gru-position": replace(BASE, feature_form="position"),
    "gru-combined": replace(BASE, feature_form="combined"),
}

TABLES: dict[int, dict[str, str]] = {
    1: {"fc6": "FC-6", "cnn1d": "CNN-1D", "rnn": "RNN", "lstm": "LSTM", "gru": "GRU (the paper's)"},
    2: {"gru-p": "P", "gru-pk": "PK", "gru": "PKV"},
    3: {
        "gru-position": "position-orientation",
        "gru-paper": "velocity, as the paper prints it",
        "gru": "velocity, version 1",
        "gru-combined": "combined",
    },
}


@dataclass(frozen=True)
class Trained:
    """A run and its settings."""

    run: Run
    config: TrainingConfig

    @property
    def cost(self) -> str:
        """Cells: steps, seed, minutes."""
        return f"{self.run.step:,} | {self.config.seed} | {self.run.wall_s / 60.0:.0f}"


def train_missing(row: str, data: Path, out: Path, cache: Path, steps: int, seed: int) -> None:
    """Train a row to so many steps, or go on where it stopped."""
    done = steps_done(out / row)
    if done >= steps:
        return
    out.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "lobstr_hw.runtime.commands.train", str(data)]
    command += ["--cache", str(cache), "--out", str(out / row)]
    if done:
        command += ["--resume", "--steps", str(steps)]
    else:
        settings = out / f"{row}.json"
        write_config(settings, replace(SETTINGS[row], steps=steps, seed=seed))
        command += ["--config", str(settings)]
    print(f"{row}: training from step {done} to {steps}", file=sys.stderr, flush=True)
    subprocess.run(command, check=True)
    if steps_done(out / row) < steps:
        raise SystemExit("stopped; the same command goes on")


def steps_done(folder: Path) -> int:
    """Steps of a run's newest checkpoint."""
    curve = folder / "curve.csv"
    if not (folder / "checkpoint.pt").is_file() or not curve.is_file():
        return 0
    with curve.open(encoding="utf-8", newline="") as file:
        return sum(1 for _ in csv.reader(file)) - 1


def trained(row: str, out: Path) -> Trained:
    """Read a row's run."""
    config = replace(read_config(out / row / "config.json"), device="cpu")
    return Trained(load_checkpoint(out / row / "checkpoint.pt", config), config)
