"""From which the size of the network was chosen: error of strangers against the time of a step.

    python tools/error_against_cost.py RUN... [--write]

Each RUN is a folder of lobstr-train with a validation, all with the same number of steps. The
networks are exported and stepped in turn, one person, the shipped ones of the paper's recipe and of
this project's beside them. ``--write`` puts the table into docs/results.md and the picture beside.
"""

import argparse
import csv
import datetime
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from results_page import RESULTS, write_section

from lobstr_hw.predictors.weights import Network, load_network
from lobstr_hw.training.config import read_config
from lobstr_hw.training.shipping import export_run

TITLE = "## Error against cost"
PICTURE = RESULTS.parent / "pictures" / "error_against_cost.png"
PAPER = Path(__file__).parent.parent / "lobstr_hw" / "models" / "lobstr-paper.onnx"


@dataclass(frozen=True, slots=True)
class Point:
    """A network: size of its state, numbers, least toe error in validation, time of a step."""

    hidden: int
    steps: int
    parameters: int
    toe_cm: float
    ms: float
    of_paper: float


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--repeats", type=int, default=2000)
    parser.add_argument("--write", action="store_true", help="table and picture into docs/")
    args = parser.parse_args()
    points = sorted(_points(args.runs, args.repeats), key=lambda point: point.hidden)
    text = "\n".join([_head(len(points)), *_rows(points)])
    print(text)
    if args.write:
        _draw(points)
        write_section(text)
    return 0


def _points(runs: Sequence[Path], repeats: int) -> list[Point]:
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{i}.onnx" for i in range(len(runs))]
        for run, file in zip(runs, files, strict=True):
            export_run(run, file)
        networks = [load_network(path) for path in (*files, PAPER)]
        ms = _median_ms(networks, repeats)
    return [
        Point(
            hidden=read_config(run / "config.json").hidden_size,
            steps=read_config(run / "config.json").steps,
            parameters=int(network.card.model.details["parameters"]),
            toe_cm=_best_toe_cm(run / "validation.csv"),
            ms=each,
            of_paper=each / ms[-1],
        )
        for run, network, each in zip(runs, networks, ms, strict=False)
    ]


def _median_ms(networks: Sequence[Network], repeats: int) -> list[float]:
    """Of the processor's time for a step at batch 1; the networks take turns."""
    rng = np.random.default_rng(0)
    states = [np.zeros((1, n.card.hidden_size), dtype=np.float32) for n in networks]
    took = np.zeros((repeats, len(networks)))
    for i in range(repeats):
        x = rng.standard_normal((1, 37)).astype(np.float32)
        for k, network in enumerate(networks):
            began = time.process_time_ns()
            states[k], _, _ = network.step(x, states[k])
            took[i, k] = 1e-6 * (time.process_time_ns() - began)
    return [float(value) for value in np.median(took, axis=0)]


def _best_toe_cm(path: Path) -> float:
    with path.open(encoding="utf-8", newline="") as file:
        return min(float(row["toe_cm"]) for row in csv.DictReader(file))


def _head(count: int) -> str:
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

`python tools/error_against_cost.py RUN...` over {count} runs, {date}: toe error on the validation
people (folders count alike, as the run itself measures), and the processor's time of the network's
step at batch 1, the networks in turn; the last column is of the shipped `lobstr-paper` in the same
run. Drawn in pictures/error_against_cost.png.
"""


def _rows(points: Sequence[Point]) -> list[str]:
    rows = [
        "| hidden | steps | parameters | toes cm, validation | a step, ms | of the paper's |",
        "|---|---|---|---|---|---|",
    ]
    for p in points:
        rows.append(
            f"| {p.hidden} | {p.steps} | {p.parameters:,} | {p.toe_cm:.2f} | {p.ms:.3f} "
            f"| {p.of_paper:.2f} |"
        )
    return rows


def _draw(points: Sequence[Point]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.0, 4.0), layout="constrained")
    axes.plot([p.of_paper for p in points], [p.toe_cm for p in points], "o-")
    for p in points:
        axes.annotate(
            str(p.hidden),
            (p.of_paper, p.toe_cm),
            xytext=(6, 6),
            textcoords="offset points",
        )
    axes.axvline(0.5, color="gray", linestyle=":")
    axes.set_xlabel("time of a step at batch 1, of the paper's network")
    axes.set_ylabel("toe error of the validation people, cm")
    axes.set_title(f"size of the state, {points[0].steps} steps each", fontsize=10)
    figure.savefig(PICTURE, dpi=110)
    pyplot.close(figure)


if __name__ == "__main__":
    raise SystemExit(main())
