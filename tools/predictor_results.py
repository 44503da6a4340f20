"""The sections of docs/results.md on the shipped networks, measured.

python tools/predictor_results.py DATA OUT [--weights FILE.onnx] [--write docs/results.md]

DATA is the folder with one folder per set. Documents of lobstr-evaluate's kind go to OUT; one that
is there is not made again. With --write the section is put into the page, else it is printed.
"""

import argparse
import json
import sys
from datetime import date
from pathlib import Path
from typing import Any

from results_page import write_section
from split_clips import truths

from lobstr_hw.evaluation.evaluate import evaluate
from lobstr_hw.evaluation.rollout import Mode
from lobstr_hw.evaluation.tables import document, markdown_table
from lobstr_hw.predictors import SHIPPED_WEIGHTS, Predictor, load_predictor
from lobstr_hw.predictors.trivial import mean_pose, standing
from lobstr_hw.predictors.weights import read_card

PARTS = {
    "test": "People nobody trained on",
    "test_same_actor": "Held-out clips of the training actors",
}
ROWS = {
    "carried": "the network, carried",
    "windowed": "the same network, windowed",
    "mean_pose": "mean pose of the training data",
    "standing": "constant standing pose",
}
TITLES = {
    "lobstr": "The network that ships (`lobstr`)",
    "lobstr-paper": "The paper's recipe (`lobstr-paper`)",
}
PAPER = """The paper's Table 1, **measured on other data** (its own split of PFNN, MHAD and CMU, its
own skeleton, contact by 1 cm):

| | contact % | rotation ° | toes cm |
|---|---|---|---|
| FC-6 | 84.22 | 9.37 | 7.2 |
| CNN-1D | 72.33 | 13.86 | 13.3 |
| RNN | 82.27 | 9.43 | 7.1 |
| LSTM | 83.85 | 8.50 | 6.63 |
| GRU (the paper's) | 85.77 | 8.53 | 6.63 |
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--weights", type=Path, default=SHIPPED_WEIGHTS)
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for part in PARTS:
        _measure(options, part)
    section = _section(options)
    if options.write:
        write_section(section, options.write)
    else:
        print(section)


def _measure(options: argparse.Namespace, part: str) -> None:
    missing = [row for row in ROWS if not _path(options.out, part, row).is_file()]
    if not missing:
        return
    clips = list(truths(options.data, part))
    for row in missing:
        mode: Mode = "windowed" if row == "windowed" else "carried"
        print(f"{part}: {row}", file=sys.stderr, flush=True)
        results = evaluate(_predictor(options.weights, row), clips, mode)
        text = json.dumps(document(results), indent=1)
        _path(options.out, part, row).write_text(text + "\n", encoding="utf-8")


def _path(out: Path, part: str, row: str) -> Path:
    return out / f"{part}-{row}.json"


def _predictor(weights: Path, row: str) -> Predictor:
    if row == "standing":
        return standing()
    if row == "mean_pose":
        return mean_pose(read_card(weights.with_suffix(".json")))
    return load_predictor(str(weights))


def _section(options: argparse.Namespace) -> str:
    card = read_card(options.weights.with_suffix(".json")).model
    parts = [_recipe(card.details)]
    for part, title in PARTS.items():
        trees = {row: _read(options.out, part, row) for row in ROWS}
        frames = trees["carried"]["all"]["network"]["frames"]
        minutes = (
            f"{frames / 45.0 / 60.0:.1f} minutes scored, {len(trees['carried']['clips'])} clips"
        )
        parts.append(f"### {title} (`{part}`, {minutes})\n\n{_table(trees)}\n")
        parts.append(f"By set, carried:\n\n{_by_set(trees['carried'])}\n")
    title = TITLES.get(card.name, card.name)
    return (
        f"## {title}\n\n" + "\n".join(parts) + ("\n" + PAPER if card.name == "lobstr-paper" else "")
    )


def _read(out: Path, part: str, row: str) -> dict[str, Any]:
    tree: dict[str, Any] = json.loads(_path(out, part, row).read_text(encoding="utf-8"))
    return tree


def _recipe(details: dict[str, Any]) -> str:
    config, data = details["configuration"], details["data"]
    minutes = data["minutes_by_set"]
    sets = ", ".join(f"{name} {value}" for name, value in minutes.items())
    return (
        f"`{_command(config)}`: {details['architecture']} "
        f"({details['parameters']:,} parameters), {_how(config)}, "
        f"{details['steps_done']:,} steps, seed {config['seed']}, products in "
        f"{config['precision']}, {details['wall_s'] / 60.0:.0f} minutes on one thread of a shared "
        f"two-core machine; {_weights(details)}. Split "
        f"`{data['split']}` (`lobstr_hw/training/splits`), "
        f"{data['clips']} clips or pieces of clips, {sum(minutes.values()):.0f} minutes before "
        f"mirroring ({sets}). {_chosen(config)}\n\n"
        "Scored by `python tools/predictor_results.py DATA OUT --weights FILE.onnx` (the same "
        "figures as `lobstr-evaluate DATA --part PART [--mode windowed] [--predictor NAME]`): "
        "trackers from the truth without noise, the true root, lengths on the 1.0 m skeleton. "
        "`network` is FK of what was predicted, `after IK` the shown body with contact lock and "
        f"floor; contact after IK is the lock. Measured {date.today().isoformat()}.\n"
    )


def _chosen(config: dict[str, Any]) -> str:
    if config["carried"].get("sitting_share", 0.0) == 0.0:
        return "Nothing was chosen on a test part."
    return (
        "Nothing was chosen on a test part but that people sit down in training: this was judged "
        "by the two captures of a chair in `test_same_actor` (docs/experiments.md)."
    )


def _command(config: dict[str, Any]) -> str:
    if config.get("teachers"):
        return "python tools/train_shipped.py DATA RUNS"
    everybody = " --everybody" if config.get("everybody", False) else ""
    return (
        f"lobstr-train DATA --out RUN --recipe {config['recipe']} --seed {config['seed']} "
        f"--precision {config['precision']}{everybody}"
    )


def _weights(details: dict[str, Any]) -> str:
    if details["configuration"].get("everybody", False):
        return (
            "the mean weights at the end. The validation people were trained on too; settings and "
            "steps are those of a training without them (docs/experiments.md)"
        )
    return f"the weights of step {details['validation']['step']:,.0f}"


def _how(config: dict[str, Any]) -> str:
    if config["recipe"] == "paper":
        return (
            f"the paper's recipe: batches of {config['batch']} windows of {config['window']} "
            "frames from a zero state, loss on the last frame, drifting tracker errors"
        )
    return (
        f"state carried over long streams: {config['batch']} streams in chunks of "
        f"{config['window']} frames, loss on every frame (docs/decisions.md){_taught(config)}"
    )


def _taught(config: dict[str, Any]) -> str:
    teachers = config.get("teachers", [])
    if not teachers:
        return ""
    each = ", ".join(f"GRU {t['hidden_size']} of {t['steps']:,} steps" for t in teachers)
    return f", {config['taught']:.0%} of it against what {len(teachers)} teachers say ({each})"


def _table(trees: dict[str, dict[str, Any]]) -> str:
    rows = []
    for row, label in ROWS.items():
        rows.append((f"{label}: network", trees[row]["all"]["network"]))
        rows.append((f"{label}: after IK", trees[row]["all"]["after_ik"]))
    return markdown_table(rows)


def _by_set(tree: dict[str, Any]) -> str:
    rows = []
    for folder, pair in tree["folders"].items():
        rows.append((f"{folder}: network", pair["network"]))
        rows.append((f"{folder}: after IK", pair["after_ik"]))
    return markdown_table(rows)


if __name__ == "__main__":
    main()
