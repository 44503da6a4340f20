"""The CSV of ``lobstr-log export`` -> a tracker log."""

import csv
import io
import math
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from lobstr_hw.drivers.lighthouse.capture_stream import open_capture
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.errors import FileFormatError
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import from_quat_xyzw
from lobstr_hw.runtime.commands.log_export import CSV_COLUMNS
from lobstr_hw.runtime.commands.log_report import Report, Step, whole_file
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

__all__ = ["csv_samples", "import_csv"]

BATCH = 500


def import_csv(path: Path, out: Path, step: Step) -> Report:
    """Write the log of a CSV."""
    with whole_file(out) as part:
        rows = _write(part, csv_samples(_lines(path), str(path)), step)
    document = {"file": str(out), "kind": "csv", "rows": rows}
    return Report(f"{out}: {rows} samples", document)


def _lines(path: Path) -> Iterator[str]:
    """A generator, so that errors of reading are told apart from those of writing."""
    with (
        open_capture(path) as stream,
        io.TextIOWrapper(stream, encoding="utf-8", errors="replace", newline="") as lines,
    ):
        try:
            yield from lines
        except (EOFError, zlib.error) as error:
            raise FileFormatError(
                f"{path} is cut short or damaged. Unpack what is left of it, and import that."
            ) from error


def _write(path: Path, rows: Iterable[tuple[TrackerRole | None, TrackerSample]], step: Step) -> int:
    roles: dict[str, TrackerRole | None] = {}
    batch: list[TrackerSample] = []
    count = 0
    with TrackerLogWriter(path) as writer:
        for role, sample in rows:
            if sample.serial not in roles or roles[sample.serial] != role:
                writer.add_samples(batch)
                batch = []
                roles[sample.serial] = role
                writer.add_state(sample.serial, role, sample.state, sample.tracked, sample.time_s)
            batch.append(sample)
            count += 1
            if len(batch) >= BATCH:
                writer.add_samples(batch)
                batch = []
                step(count)
        writer.add_samples(batch)
    return count


def csv_samples(
    lines: Iterable[str], name: str
) -> Iterator[tuple[TrackerRole | None, TrackerSample]]:
    """Role and sample of each row.

    Raises:
        FileFormatError: the first line is not export's, or a row cannot be read.
    """
    rows = csv.reader(lines)
    head = next(rows, [])
    if tuple(head) != CSV_COLUMNS:
        raise FileFormatError(f"{name} does not begin with {','.join(CSV_COLUMNS)}")
    for row in rows:
        try:
            yield _sample(row)
        except (ValueError, IndexError) as error:
            raise FileFormatError(
                f"{name}, line {rows.line_num}: {error}. Mend or delete this line."
            ) from error


def _sample(row: list[str]) -> tuple[TrackerRole | None, TrackerSample]:
    if len(row) != len(CSV_COLUMNS):
        raise ValueError(f"{len(row)} columns instead of {len(CSV_COLUMNS)}")
    if row[10] not in ("0", "1"):
        raise ValueError(f"tracked is {row[10]!r} instead of 0 or 1")
    time_s, tracked = float(row[0]), row[10] == "1"
    if not 0.0 <= time_s < math.inf:
        raise ValueError(f"time {row[0]!r} is not a number from 0 up")
    p = None if row[3] == "" else np.array([float(v) for v in row[3:6]])
    q = np.array([float(v) for v in row[6:10]])
    if not np.any(q):
        raise ValueError("a quaternion of zeros is no rotation")
    role = TrackerRole(row[2]) if row[2] else None
    state = TrackingState.OK if tracked else TrackingState.OCCLUDED
    return role, TrackerSample(row[1], PartialPose(from_quat_xyzw(q), p), time_s, tracked, state)
