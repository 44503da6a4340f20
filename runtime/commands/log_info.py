"""``lobstr-log info``: what a log holds, and how good it is."""

import argparse
import io
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from lobstr_hw.drivers.tracker_log import TrackerLog, read_log
from lobstr_hw.drivers.tracker_log.quality import Quality, quality, sample_rate
from lobstr_hw.runtime.commands.log_report import Report, Subparsers, progress_bar

__all__ = ["add_parser", "run"]


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """The options of ``info``."""
    parser = subparsers.add_parser(
        "info",
        help="devices, rates, drop-outs, jumps",
        description="Say what a log holds: devices, roles, rates, drop-outs, jumps, T-pose, truth, "
        "and whether the file is whole.",
        epilog="example: lobstr-log info take.mcap --json",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a tracker log")
    return parser


def run(options: argparse.Namespace) -> Report:
    """Look into the log."""
    with progress_bar("reading the log"):
        log = read_log(options.file)
        rows = [_Row(track.serial, track.role or "", quality(track)) for track in log.trackers]
    return Report(_text(log, rows), _document(log, rows))


@dataclass(frozen=True, slots=True)
class _Row:
    serial: str
    role: str
    quality: Quality


def _document(log: TrackerLog, rows: list[_Row]) -> dict[str, Any]:
    return {
        "file": str(log.path),
        "bytes": log.path.stat().st_size,
        "whole": not log.cut,
        "damage": log.damage or None,
        "duration_s": round(log.duration_s, 6),
        "begun": _begun(log),
        "trackers": [_tracker(row) for row in rows],
        "t_pose_s": None if log.t_pose_s is None else [round(t, 6) for t in log.t_pose_s],
        "truth": None
        if log.truth is None
        else {
            "frames": len(log.truth.times_s),
            "rate_hz": round(sample_rate(log.truth.times_s), 3),
            "rotations": log.truth.R_world is not None,
        },
        "skeleton": None
        if log.skeleton is None
        else {
            "frames": len(log.skeleton.times_s),
            "rate_hz": round(sample_rate(log.skeleton.times_s), 3),
        },
        "profile": log.profile is not None,
        "metadata": log.metadata,
    }


def _tracker(row: _Row) -> dict[str, Any]:
    q = row.quality
    return {
        "serial": row.serial,
        "role": row.role or None,
        "samples": q.samples,
        "rate_hz": round(q.rate_hz, 3),
        "dropouts_s": [[round(float(t), 6) for t in pair] for pair in q.dropouts_s],
        "lost_s": round(q.lost_s, 6),
        "jumps_s": [round(float(t), 6) for t in q.jumps_s],
        "broken_samples": q.broken,
    }


def _begun(log: TrackerLog) -> str | None:
    if log.unix_offset_s is None:
        return None
    return datetime.fromtimestamp(log.start_s + log.unix_offset_s, UTC).isoformat()


def _text(log: TrackerLog, rows: list[_Row]) -> str:
    table = Table(box=None, pad_edge=False)
    for title in ("serial", "role"):
        table.add_column(title)
    for title in ("samples", "Hz", "drop-outs", "lost s", "jumps", "broken"):
        table.add_column(title, justify="right")
    for row in rows:
        q = row.quality
        counts = (f"{len(q.dropouts_s)}", f"{q.lost_s:.2f}", f"{len(q.jumps_s)}", f"{q.broken}")
        table.add_row(row.serial, row.role or "-", f"{q.samples}", f"{q.rate_hz:.1f}", *counts)
    page = io.StringIO()
    Console(file=page, width=100).print(table)
    return "\n".join([_headline(log), page.getvalue().rstrip(), *_extras(log)])


def _headline(log: TrackerLog) -> str:
    size = log.path.stat().st_size / 1e6
    state = f"CUT: {log.damage}" if log.cut else "whole"
    line = f"{log.path}: {log.duration_s:.1f} s, {size:.2f} MB, {state}"
    return line + ("; mend it with: lobstr-log repair FILE OUT" if log.cut else "")


def _extras(log: TrackerLog) -> list[str]:
    lines = []
    begun = _begun(log)
    if begun:
        lines.append(f"begun: {begun}")
    if log.t_pose_s is None:
        lines.append("T-pose: not marked")
    else:
        lines.append(f"T-pose: {log.t_pose_s[0]:.2f} to {log.t_pose_s[1]:.2f} s")
    if log.truth is not None:
        rate = sample_rate(log.truth.times_s)
        lines.append(f"truth: {len(log.truth.times_s)} bodies at {rate:.1f} Hz")
    if log.skeleton is not None:
        rate = sample_rate(log.skeleton.times_s)
        lines.append(f"skeleton: {len(log.skeleton.times_s)} bodies at {rate:.1f} Hz")
    if log.profile is not None:
        lines.append("calibration profile: attached")
    for name, words in log.metadata.items():
        lines.append(f"{name}: " + ", ".join(f"{key} {value}" for key, value in words.items()))
    return lines
