"""``lobstr-log export``: samples as CSV, bodies as BVH or NDJSON."""

import argparse
import csv
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

import numpy as np

from lobstr_hw.drivers.tracker_log import TrackerLog, read_log
from lobstr_hw.runtime.commands.log_bodies import Bodies, bodies_of
from lobstr_hw.runtime.commands.log_report import Report, Step, Subparsers, progress_bar, whole_file
from lobstr_hw.runtime.outputs.bvh import BvhOutput
from lobstr_hw.runtime.outputs.ndjson import NdjsonOutput
from lobstr_hw.runtime.outputs.output import Output

__all__ = ["CSV_COLUMNS", "add_parser", "run", "write_csv"]

CSV_COLUMNS = (
    "time_s", "serial", "role", "px", "py", "pz", "qx", "qy", "qz", "qw", "tracked",
)  # fmt: skip


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """The options of ``export``."""
    parser = subparsers.add_parser(
        "export",
        help="CSV of the samples; BVH or NDJSON of the body",
        description="--csv writes one row per sample. --bvh and --ndjson write the skeleton that "
        "was recorded with the trackers, or else the truth of a made log.",
        epilog="example: lobstr-log export take.mcap --csv take.csv",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a tracker log")
    target = parser.add_mutually_exclusive_group(required=True)
    for name in ("csv", "bvh", "ndjson"):
        target.add_argument(f"--{name}", type=Path, metavar="OUT")
    target.add_argument("--gltf", type=_not_yet, metavar="OUT", help="not in this version")
    return parser


def _not_yet(text: str) -> Path:
    raise argparse.ArgumentTypeError(
        "glTF is not in this version; export --bvh, and let Blender write glTF from it"
    )


def run(options: argparse.Namespace) -> Report:
    """Write the file asked for."""
    with progress_bar("reading the log") as step:
        log = read_log(options.file)
        if options.csv:
            kind, target = "csv", options.csv
            with whole_file(target) as part:
                rows = _csv_file(log, part, step)
        else:
            kind, target = ("bvh", options.bvh) if options.bvh else ("ndjson", options.ndjson)
            make: Callable[[Path], Output] = (
                BvhOutput if options.bvh else lambda part: NdjsonOutput(str(part))
            )
            bodies = bodies_of(log)
            with whole_file(target) as part:
                rows = _play(bodies, make(part), step)
    document = {"file": str(target), "kind": kind, "rows": rows, "damage": log.damage or None}
    cut = f"; the log is cut: {log.damage}" if log.cut else ""
    return Report(f"{target}: {rows} {'samples' if options.csv else 'frames'}{cut}", document)


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


def _play(bodies: Bodies, output: Output, step: Step) -> int:
    """Send bodies to an output as the live program would."""
    output.open(bodies.body, bodies.rate_hz, "export")
    try:
        output.calibrated(bodies.body)
        for i in range(len(bodies)):
            output.send(bodies.pose(i), ())
            step(i, len(bodies))
    finally:
        output.close()
    return len(bodies)
