"""Pictures of scores: which clips are good and which are not."""

from collections.abc import Sequence
from pathlib import Path

from lobstr_hw.evaluation.tables import COLUMNS, ClipResult

__all__ = ["plot_results"]

PLOTTED = (
    "position_error_cm",
    "rotation_error_legs_deg",
    "contact_balanced_accuracy",
    "skate_cm_s",
)


def plot_results(folder: Path, results: Sequence[ClipResult]) -> None:
    """One picture per metric, ``METRIC.png``: a dot per clip before and after IK, by folder."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    folders = sorted({r.folder for r in results})
    for metric in PLOTTED:
        title, factor = COLUMNS[metric]
        figure = Figure(figsize=(8.0, 1.5 + 0.5 * len(folders)), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        for stage, marker, shift in (("network", "o", -0.15), ("after_ik", "x", 0.15)):
            points = [
                (factor * value, folders.index(r.folder) + shift)
                for r in results
                if (value := getattr(r, stage).scores()[metric]) is not None
            ]
            axes.plot([x for x, _ in points], [y for _, y in points], marker, label=stage)
        axes.set_yticks(range(len(folders)), folders)
        axes.set_xlabel(f"{title}, a mark per clip")
        axes.legend()
        figure.savefig(folder / f"{metric}.png", dpi=120)
