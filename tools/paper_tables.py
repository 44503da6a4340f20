"""Tables 1, 2 and 3 of the paper on this project's data and split.

    python tools/paper_tables.py DATA OUT [--table 1|2|3 ...] [--steps 1500] [--seed 1] [--write]

DATA is the folder with one folder per set. What is not trained yet is trained, a run's folder per
row in OUT; a stopped command goes on where it was, and a larger number of steps goes on from the
smaller one. With --write the sections are put into docs/results.md, else they are printed.
"""

import argparse
import datetime
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import torch
from paper_logs import CLIPS, LONGEST_S, STATURES_CM, Scored, Worn, motions, recordings, scored
from paper_rows import BASE, TABLES, Trained, train_missing, trained
from paper_scores import cost_of, scores
from results_page import write_section
from split_clips import truths

from lobstr_hw.evaluation.activities import Activity
from lobstr_hw.evaluation.metrics import Scores
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.motion import Motion
from lobstr_hw.training.network import parameter_count

PARTS = {"test": "People nobody trained on", "test_same_actor": "Other clips of known people"}
TITLES = {
    1: "## The paper's Table 1: networks",
    2: "## The paper's Table 2: losses",
    3: "## The paper's Table 3: the form of the input",
}
COLUMNS: dict[str, tuple[str, float]] = {
    "contact_accuracy": ("contact %", 100.0),
    "contact_balanced_accuracy": ("balanced %", 100.0),
    "contact_accuracy_1cm": ("1 cm label %", 100.0),
    "rotation_error_deg": ("rotation °", 1.0),
    "rotation_error_legs_deg": ("legs °", 1.0),
    "position_error_cm": ("toes cm", 1.0),
    "velocity_error_cm_s": ("velocity cm/s", 1.0),
    "jitter_ratio": ("jitter", 1.0),
}
PAPERS = {
    1: "In the paper, on other data (contact by 1 cm, 8 joints, toes): FC-6 84.22 %, 9.37°, "
    "7.2 cm; CNN-1D 72.33 %, 13.86°, 13.3 cm; RNN 82.27 %, 9.43°, 7.1 cm; LSTM 83.85 %, 8.50°, "
    "6.63 cm; GRU 85.77 %, 8.53°, 6.63 cm.",
    2: "In the paper, on other data: P 6.95 cm, PK 6.64 cm, PKV 6.63 cm.",
    3: "In the paper, of real people with trackers, toe-base distance error at 157 / 171 / 184 cm: "
    "velocity 4.4 / 4.6 / 2.1 cm, position-orientation 6.0 / 5.0 / 5.2 cm, combined "
    "13.3 / 11.9 / 13.0 cm.",
}


@dataclass(frozen=True)
class Sources:
    """Where everything is, and how much of it is scored."""

    data: Path
    out: Path
    every_s: float
    logs_seed: int

    def scores(self, row: str, network: Trained, part: str) -> Scores:
        """Of a row on a part."""
        kept = self.out / "scores" / f"{row}-{part}.json"
        return scores(network, partial(_clips, self.data, part), self.every_s, kept)

    def scored(self, row: str, network: Trained, stature_cm: int) -> Scored:
        """Of a row on the recordings of a stature."""
        kept = self.out / "scores" / f"{row}-{stature_cm}cm-{self.logs_seed}.json"
        worn = partial(_recordings, self.data, stature_cm, self.logs_seed)
        return scored(network, worn, kept)


@cache
def _clips(data: Path, part: str) -> list[Truth]:
    _say(f"reading {part}")
    return list(truths(data, part))


@cache
def _motions(data: Path) -> list[Motion]:
    _say("reading the clips of the recordings")
    return motions(data)


@cache
def _recordings(data: Path, stature_cm: int, seed: int) -> list[Worn]:
    _say(f"recordings of {stature_cm} cm")
    return recordings(_motions(data), stature_cm, seed)


def main() -> int:
    """Train, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--table", type=int, choices=(1, 2, 3), action="append")
    parser.add_argument("--steps", type=int, default=BASE.steps)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--every", type=float, default=5.0, help="seconds; one of them is scored")
    parser.add_argument("--logs-seed", type=int, default=9000)
    parser.add_argument("--cache", type=Path, help="retargeted clips (OUT/cache)")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    torch.set_num_threads(1)
    tables = args.table or [1, 2, 3]
    cache = args.cache or args.out / "cache"
    for row in dict.fromkeys(row for table in tables for row in TABLES[table]):
        train_missing(row, args.data, args.out, cache, args.steps, args.seed)
    sources = Sources(args.data, args.out, args.every, args.logs_seed)
    for table in tables:
        text = _section(table, sources)
        print(text)
        if args.write:
            write_section(text)
    return 0


def _section(table: int, sources: Sources) -> str:
    rows = {row: trained(row, sources.out) for row in TABLES[table]}
    parts = [TITLES[table], "", _head(table, sources, rows), ""]
    for part, title in PARTS.items():
        parts += [f"### {title} (`{part}`)", ""]
        parts += [_part_table(sources, rows, TABLES[table], part), ""]
    if table == 1:
        parts += [_cost_table(rows), ""]
    if table == 3:
        parts += [*_log_tables(sources, rows), ""]
    return "\n".join([*parts, PAPERS[table]])


def _head(table: int, sources: Sources, rows: dict[str, Trained]) -> str:
    run, config = next(iter(rows.values())).run, next(iter(rows.values())).config
    data = json.loads((sources.out / next(iter(rows)) / "data.json").read_text(encoding="utf-8"))
    today = datetime.datetime.now(tz=datetime.UTC).date()
    fallen = config.learning_rate_decay**run.step
    least = min(row.run.step for row in rows.values())
    few = f"As few as {least:,} steps where the paper has {BASE.steps:,}. "
    command = f"DATA OUT --table {table} --steps {run.step}"
    text = f"""All rows alike: split `{data["split"]}`, {data["clips"]} clips or pieces of clips,
    {sum(data["minutes_by_set"].values()):.0f} minutes before mirroring; batches of {config.batch}
    windows of {config.window} frames from zero, loss on the last frame, drifting tracker errors,
    Adam from {config.learning_rate:g} times {config.learning_rate_decay} a step (to {fallen:.2f}
    of it at the end), {config.precision} products, hidden {config.hidden_size}, latent 128.
    **{few if least < BASE.steps else ""}One seed**: rows that are close are not in
    order. Scored by windows with products as in training, one second in every
    {sources.every_s:g} of each clip, trackers from the truth; the network alone, before lock and
    IK. Minutes are of one thread of a shared two-core machine."""
    return f"`python tools/paper_tables.py {command}`, {today}.\n\n{' '.join(text.split())}"


def _part_table(
    sources: Sources, rows: dict[str, Trained], labels: dict[str, str], part: str
) -> str:
    head = [label for label, _ in COLUMNS.values()]
    lines = [f"| | {' | '.join(head)} | steps | seed | minutes |", "|---" * (len(head) + 4) + "|"]
    frames: object = 0
    for row, network in rows.items():
        found = sources.scores(row, network, part)
        cells = [_cell(found[key], factor) for key, (_, factor) in COLUMNS.items()]
        lines.append(f"| {labels[row]} | {' | '.join(cells)} | {network.cost} |")
        frames = found["frames"]
    return "\n".join([*lines, "", f"{frames:,} frames scored."])


def _cell(value: float | int | None, factor: float = 1.0) -> str:
    return "-" if value is None else f"{factor * value:.2f}"


def _cost_table(rows: dict[str, Trained]) -> str:
    lines = [
        "| | parameters | a window of 45 frames, ms | a carried step, ms |",
        "|---|---|---|---|",
    ]
    for row in TABLES[1]:
        network = rows[row]
        cost = cost_of(network)
        lines.append(
            f"| {TABLES[1][row]} | {parameter_count(network.run.network):,} "
            f"| {cost.window_ms:.2f} | {_cell(cost.step_ms)} |"
        )
    note = (
        "One output at batch 1 on one core, processor time: windows by torch, steps by "
        "onnxruntime, both in fp32. What sees a window at once has no step. The paper gives no "
        "sizes of FC-6 and CNN-1D but 1,024; these are of `lobstr_hw/training/encoders.py`."
    )
    return "\n".join(["### What an output costs", "", *lines, "", note])


def _log_tables(sources: Sources, rows: dict[str, Trained]) -> list[str]:
    """Toe-base distance errors by activity, and body movement, of made recordings."""
    found = {
        (stature, row): sources.scored(row, network, stature)
        for stature in STATURES_CM
        for row, network in rows.items()
    }
    seen = [str(a) for a in Activity if any(str(a) in s.frames for s in found.values())]
    seconds = sum(next(iter(found.values())).frames.values()) / 45.0
    return [
        "### Made recordings of three statures",
        "",
        f"The first {LONGEST_S:g} s of each piece of {len(CLIPS)} clips that nobody trained on, "
        f"{seconds:.0f} s scored a stature, done by people of that stature with their own "
        f"proportions (seed {sources.logs_seed}), trackers on at random places, Lighthouse errors, "
        "calibrated by a sloppy T-pose. Error of the distance between the toe bases in the user's "
        "centimetres, by what is done in the frame (`lobstr_hw/evaluation/activities.py`); "
        "activities of less than two seconds in brackets.",
        "",
        *_distance_table(found, rows, seen),
        "",
        "Body movement (the paper's Figure 7): by how much the eight joints together turn from "
        "frame to frame, degrees; the truth's own below.",
        "",
        *_movement_table(found, rows),
    ]


def _distance_table(
    found: dict[tuple[int, str], Scored], rows: dict[str, Trained], seen: Sequence[str]
) -> list[str]:
    lines = [f"| cm | input | {' | '.join(seen)} | all |", "|---" * (len(seen) + 3) + "|"]
    for (stature, row), result in found.items():
        cells = [_mean(result, activity) for activity in seen]
        lines.append(
            f"| {stature} | {TABLES[3][row]} | {' | '.join(cells)} | {result.mean_cm:.2f} |"
        )
    return lines


def _mean(result: Scored, activity: str) -> str:
    frames = result.frames.get(activity, 0)
    if frames == 0:
        return "-"
    text = f"{result.apart_cm[activity] / frames:.1f}"
    return text if frames >= 90 else f"({text})"


def _movement_table(found: dict[tuple[int, str], Scored], rows: dict[str, Trained]) -> list[str]:
    head = " | ".join(f"{stature} cm" for stature in STATURES_CM)
    lines = [f"| input | {head} |", "|---" * (len(STATURES_CM) + 1) + "|"]
    for row in rows:
        cells = [f"{found[stature, row].update_deg:.2f}" for stature in STATURES_CM]
        lines.append(f"| {TABLES[3][row]} | {' | '.join(cells)} |")
    row = next(iter(rows))
    cells = [f"{found[stature, row].true_update_deg:.2f}" for stature in STATURES_CM]
    return [*lines, f"| the truth | {' | '.join(cells)} |"]


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
