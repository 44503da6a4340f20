"""The curves of a run as CSV and as a picture."""

import csv
import os
from collections.abc import Sequence
from pathlib import Path

from lobstr_hw.training.checkpoint import Run
from lobstr_hw.training.loop import CURVE_COLUMNS, VALIDATION_COLUMNS

__all__ = ["plot_curves", "write_curves"]


def write_curves(folder: Path, run: Run) -> None:
    """``curve.csv`` (each step) and ``validation.csv``."""
    _write(folder / "curve.csv", CURVE_COLUMNS, run.curve)
    width = len(run.validation[0]) if run.validation else len(VALIDATION_COLUMNS)
    _write(folder / "validation.csv", VALIDATION_COLUMNS[:width], run.validation)


def _write(path: Path, columns: Sequence[str], rows: Sequence[Sequence[float]]) -> None:
    partial = path.with_suffix(".partial")
    with partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows([f"{value:.6g}" for value in row] for row in rows)
    os.replace(partial, path)


def plot_curves(path: Path, run: Run) -> None:
    """Losses by step, and the validation errors below them."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    steps = [row[0] for row in run.curve]
    for column in ("total", "pose", "toe_m", "contact"):
        i = CURVE_COLUMNS.index(column)
        upper.plot(steps, [row[i] for row in run.curve], label=column, linewidth=0.8)
    upper.set_yscale("log")
    upper.set_ylabel("training loss")
    upper.legend()
    steps = [row[0] for row in run.validation]
    for column, label in (("toe_cm", "toe error (cm)"), ("rotation_deg", "rotation error (deg)")):
        i = VALIDATION_COLUMNS.index(column)
        lower.plot(steps, [row[i] for row in run.validation], marker=".", label=label)
    lower.set_xlabel("step")
    lower.set_ylabel("validation")
    lower.legend()
    figure.savefig(path, dpi=120)
