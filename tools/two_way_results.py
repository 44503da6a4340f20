"""The section of docs/results.md on recordings: the two-way network against the live one.

python tools/two_way_results.py DATA OUT [--part test] [--weights FILE.onnx] [--write RESULTS.md]

DATA is the folder with one folder per set. Documents of lobstr-evaluate's kind go to OUT; one that
is there and newer than its weights is not made again. With --write the section is put into the
page, else it is printed.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from predictor_results import PARTS
from results_page import write_section
from split_clips import truths

from lobstr_hw.drivers.tracker_log import TrackerLogWriter, read_log
from lobstr_hw.evaluation.at_once import roll_out_at_once
from lobstr_hw.evaluation.evaluate import compare
from lobstr_hw.evaluation.rollout import roll_out
from lobstr_hw.evaluation.tables import document, markdown_table
from lobstr_hw.predictors import SHIPPED_TWO_WAY, SHIPPED_WEIGHTS
from lobstr_hw.predictors.lobstr import Lobstr
from lobstr_hw.predictors.two_way import load_two_way
from lobstr_hw.predictors.weights import load_network, read_card
from lobstr_hw.runtime.sources import bundled_log
from lobstr_hw.trackers import TrackingState

ROWS = {"live": "live", "two-way": "refined"}
STAGES = {"network": "network", "after_ik": "after IK"}
LESS = {
    "toes": "position_error_cm",
    "legs": "rotation_error_legs_deg",
    "velocity": "velocity_error_cm_s",
    "skate": "skate_cm_s",
    "jitter": "jitter_ratio",
}
LOG_S = 600.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--part", choices=tuple(PARTS), default="test")
    parser.add_argument("--weights", type=Path, default=SHIPPED_TWO_WAY)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--no-time", action="store_true", help="no log of ten minutes is refined")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    _measure(options)
    section = _section(options)
    if options.write:
        write_section(section, options.write)
    else:
        print(section)


def _path(options: argparse.Namespace, row: str) -> Path:
    path: Path = options.out / f"recordings-{options.part}-{row}.json"
    return path


def _measure(options: argparse.Namespace) -> None:
    stale = [row for row in ROWS if _is_stale(_path(options, row), _weights(options, row))]
    if not stale:
        return
    clips = list(truths(options.data, options.part))
    for row in stale:
        print(f"{options.part}: {row}", file=sys.stderr, flush=True)
        live = Lobstr(load_network(SHIPPED_WEIGHTS))
        if row == "live":
            results = compare(live.card, clips, roll_out(live, clips, "carried"))
        else:
            two_way = load_two_way(options.weights)
            results = compare(two_way.card, clips, roll_out_at_once(two_way, live, clips))
        text = json.dumps(document(results), indent=1)
        _path(options, row).write_text(text + "\n", encoding="utf-8")


def _weights(options: argparse.Namespace, row: str) -> list[Path]:
    return [SHIPPED_WEIGHTS] if row == "live" else [SHIPPED_WEIGHTS, options.weights]


def _is_stale(path: Path, weights: list[Path]) -> bool:
    return not path.is_file() or path.stat().st_mtime < max(w.stat().st_mtime for w in weights)


def _section(options: argparse.Namespace) -> str:
    trees = {row: json.loads(_path(options, row).read_text(encoding="utf-8")) for row in ROWS}
    card = read_card(options.weights.with_suffix(".json")).model
    frames = trees["live"]["all"]["network"]["frames"]
    where = f"{PARTS[options.part]} (`{options.part}`, {frames / 45.0 / 60.0:.1f} minutes scored"
    sets = {folder: {row: trees[row]["folders"][folder] for row in ROWS}
            for folder in trees["live"]["folders"]}  # fmt: skip
    return "\n".join([
        "## Recordings: the two-way network (`lobstr-two-way`)\n",
        _recipe(card.details),
        f"### {where}, {len(trees['live']['clips'])} clips)\n",
        markdown_table(_rows({row: trees[row]["all"] for row in ROWS})) + "\n",
        "Refined over live, and by set (less than 1 is better than live):\n",
        _ratios({"all": {row: trees[row]["all"] for row in ROWS}, **sets}) + "\n",
        "By set:\n",
        markdown_table([r for name, pair in sets.items() for r in _rows(pair, f"{name}: ")]) + "\n",
        *([] if options.no_time else ["### Time\n", _time()]),
    ])  # fmt: skip


def _recipe(details: dict[str, Any]) -> str:
    config, data = details["configuration"], details["data"]
    minutes = sum(data["minutes_by_set"].values())
    return (
        f"`lobstr-train DATA --out RUN --recipe two-way --seed {config['seed']}"
        f"{' --everybody' if config.get('everybody') else ''}`: {details['architecture']} "
        f"({details['parameters']:,} parameters), {details['steps_done']:,} steps of "
        f"{config['batch']} chunks of {config['window']} frames, {minutes:.0f} minutes of motion, "
        f"{details['wall_s'] / 60.0:.0f} minutes on one thread of a busy two-core machine. "
        "Settings chosen on the validation part, those of hands and strides by trainings of the "
        "live recipe; nothing on a test part, but see `lobstr` about chairs.\n\n"
        "Scored by `python tools/two_way_results.py DATA OUT`: trackers from the truth without "
        "noise, the true root, lengths on the 1.0 m skeleton. Both go through the same "
        "contact lock, floor and IK. Refined is what `lobstr-log export --refine` makes: of every "
        "frame of a clip 0.7 of the two-way network (the mean of the clip and its mirror image) "
        f"and 0.3 of the live one. Measured {date.today().isoformat()}.\n"
    )


def _rows(pair: dict[str, Any], name: str = "") -> list[tuple[str, dict[str, Any]]]:
    return [
        (f"{name}{ROWS[row]}: {STAGES[stage]}", pair[row][stage])
        for stage in STAGES
        for row in ROWS
    ]


def _ratios(groups: dict[str, Any]) -> str:
    heads = [f"{name}, {STAGES[stage]}" for stage in STAGES for name in LESS]
    lines = ["| | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for group, pair in groups.items():
        cells = [
            f"{pair['two-way'][stage][key] / pair['live'][stage][key]:.2f}"
            for stage in STAGES
            for key in LESS.values()
        ]
        lines.append(f"| {group} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _time() -> str:
    """The real command on a log of ten minutes: the demo's trackers over and over."""
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder) / "ten-minutes.mcap", Path(folder) / "out.bvh"
        _long_log(log)
        command = [sys.executable, "-m", "lobstr_hw.runtime.commands.log", "export", str(log),
                   "--bvh", str(out), "--refine"]  # fmt: skip
        began, before = time.perf_counter(), os.times()
        subprocess.run(command, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
        wall_s, after = time.perf_counter() - began, os.times()
    cpu_s = after.children_user + after.children_system
    cpu_s -= before.children_user + before.children_system
    return (
        f"`lobstr-log export LOG --bvh OUT --refine` on a log of {LOG_S / 60.0:.0f} minutes (the "
        f"demo's trackers over and over): {cpu_s:.0f} s of processor time on one core, "
        f"{wall_s:.0f} s on the clock of a machine that had other work.\n"
    )


def _long_log(path: Path) -> None:
    demo = read_log(bundled_log(), skeleton=False)
    samples = list(demo.samples())
    with TrackerLogWriter(path) as log:
        for track in demo.trackers:
            log.add_state(track.serial, track.role, TrackingState.OK, True, 0.0)
        turn = 0.0
        while turn < LOG_S:
            due = (replace(s, time_s=s.time_s + turn) for s in samples)
            log.add_samples([s for s in due if s.time_s <= LOG_S])
            turn += demo.duration_s + 1.0 / 90.0


if __name__ == "__main__":
    main()
