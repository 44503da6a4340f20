"""``lobstr-log export``: samples as CSV, bodies as BVH or NDJSON."""

import argparse
import csv
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from lobstr_hw.drivers.tracker_log import TrackerLog, read_log
from lobstr_hw.runtime.commands.log_bodies import bodies_of
from lobstr_hw.runtime.commands.log_report import Report, Step, Subparsers, progress_bar, whole_file
from lobstr_hw.runtime.outputs.bvh import BvhOutput
from lobstr_hw.runtime.outputs.ndjson import NdjsonOutput
from lobstr_hw.runtime.outputs.output import Output
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose

__all__ = ["CSV_COLUMNS", "add_parser", "run", "write_csv"]

CSV_COLUMNS = (
    "time_s", "serial", "role", "px", "py", "pz", "qx", "qy", "qz", "qw", "tracked",
)  # fmt: skip
STEP_EVERY = 45


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """The options of ``export``."""
    parser = subparsers.add_parser(
        "export",
        help="CSV of the samples; BVH or NDJSON of the body",
        description="--csv writes one row per sample. --bvh and --ndjson write the skeleton that "
        "was recorded with the trackers, or else the truth of a made log; with --refine they "
        "write a body that is worked out anew from the trackers, its legs by the network that "
        "knows what comes next.",
        epilog="examples: lobstr-log export take.mcap --csv take.csv; "
        "lobstr-log export take.mcap --bvh take.bvh --refine",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a tracker log")
    target = parser.add_mutually_exclusive_group(required=True)
    for name in ("csv", "bvh", "ndjson"):
        target.add_argument(f"--{name}", type=Path, metavar="OUT")
    target.add_argument("--gltf", type=_not_yet, metavar="OUT", help="not in this version")
    parser.add_argument(
        "--refine", action="store_true", help="the legs anew, past and future known (docs/refining)"
    )
    parser.add_argument(
        "--profile", type=Path, metavar="FILE", help="with --refine: calibration (the log's own)"
    )
    parser.set_defaults(wrong_use=parser.error)
    return parser


def _not_yet(text: str) -> Path:
    raise argparse.ArgumentTypeError(
        "glTF is not in this version; export --bvh, and let Blender write glTF from it"
    )


def run(options: argparse.Namespace) -> Report:
    """Write the file asked for."""
    if options.refine and options.csv:
        options.wrong_use("--refine makes bodies: give --bvh or --ndjson")
    if options.profile and not options.refine:
        options.wrong_use("--profile goes with --refine only: nothing else needs a calibration")
    return _refine(options) if options.refine else _export(options)


def _export(options: argparse.Namespace) -> Report:
    with progress_bar("reading the log") as step:
        log = read_log(options.file)
        if options.csv:
            kind, target = "csv", options.csv
            with whole_file(target) as part:
                rows = _csv_file(log, part, step)
        else:
            kind, target = _body_file(options)
            bodies = bodies_of(log)
            poses = (bodies.pose(i) for i in range(len(bodies)))
            with whole_file(target) as part:
                output = _output(kind, part)
                rows = _play(poses, bodies.body, bodies.rate_hz, output, step, len(bodies))
    return _report(target, kind, rows, log.damage)


def _report(target: Path, kind: str, rows: int, damage: str, *, refined: bool = False) -> Report:
    """What was written, and how far the log could be read."""
    document: dict[str, Any] = {
        "file": str(target),
        "kind": kind,
        "rows": rows,
        "damage": damage or None,
    }
    text = f"{target}: {rows} {'samples' if kind == 'csv' else 'frames'}"
    if refined:
        document["refined"] = True
        text += ", the legs refined"
    return Report(text + (f"; the log is cut: {damage}" if damage else ""), document)


def _csv_file(log: TrackerLog, part: Path, step: Step) -> int:
    with part.open("w", encoding="utf-8", newline="") as file:
        return write_csv(log, file, step)


def write_csv(log: TrackerLog, file: TextIO, step: Callable[[float, float], None]) -> int:
    """One row per sample in time order; no position leaves px, py, pz empty.

    Returns:
        The number of rows.
    """
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    times = np.concatenate([track.times_s for track in log.trackers])
    owner = np.repeat(np.arange(len(log.trackers)), [len(track) for track in log.trackers])
    row_of = np.concatenate([np.arange(len(track)) for track in log.trackers])
    order = np.argsort(times, kind="stable")
    for count, (i, row) in enumerate(zip(owner[order], row_of[order], strict=True)):
        track = log.trackers[i]
        p = [f"{v:.6f}" for v in track.p[row]] if track.has_p[row] else ["", "", ""]
        q = [f"{v:.7f}" for v in track.quat_xyzw[row]]
        head = (f"{track.times_s[row]:.9f}", track.serial, track.role or "")
        writer.writerow((*head, *p, *q, int(track.tracked[row])))
        if count % 1000 == 0:
            step(count, len(order))
    return len(order)


def _play(
    poses: Iterable[SkeletonPose],
    body: Body,
    rate_hz: float,
    output: Output,
    step: Step,
    total: int,
) -> int:
    """Send bodies to an output as the live program would; returns how many there were."""
    output.open(body, rate_hz, "export")
    sent = 0
    try:
        output.calibrated(body)
        for pose in poses:
            output.send(pose, ())
            sent += 1
            if sent % STEP_EVERY == 0:
                step(sent, total)
    finally:
        output.close()
    return sent


def _body_file(options: argparse.Namespace) -> tuple[str, Path]:
    """What kind, and which file."""
    return ("bvh", options.bvh) if options.bvh else ("ndjson", options.ndjson)


def _output(kind: str, path: Path) -> Output:
    return BvhOutput(path) if kind == "bvh" else NdjsonOutput(str(path))


def _refine(options: argparse.Namespace) -> Report:
    # imported here: the engine takes a while to load, and no other export needs it
    from lobstr_hw.runtime.refining import refined_poses, seen_in

    kind, target = _body_file(options)
    with progress_bar("playing the log") as step, whole_file(target) as part:
        recording = seen_in(options.file, options.profile, _tell, step)
        step(0, None, "the legs")
        poses = refined_poses(recording)
        step(0, len(recording.moments), "the body")
        rows = _play(
            poses,
            recording.body,
            recording.options.rate_hz,
            _output(kind, part),
            step,
            len(recording.moments),
        )
    return _report(target, kind, rows, recording.damage, refined=True)


def _tell(message: str) -> None:
    print(f"lobstr-log export: {message}", file=sys.stderr)
