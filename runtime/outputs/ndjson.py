"""``ndjson:FILE`` or ``ndjson:-``: one JSON object a line and frame, for scripts and pipes.

    {"time_s": 0.0, "frame": 0, "joints": {"Hips": [px, py, pz, qx, qy, qz, qw], ...},
     "contact": [left, right], "roles": {"head": "ok", ...}}

World, metres, right-handed, Y up; ``time_s`` counts from the first frame.
"""

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from lobstr_hw.errors import OutputError
from lobstr_hw.rotations import to_quat_xyzw
from lobstr_hw.runtime.outputs.files import create
from lobstr_hw.skeleton import HUMANOID_NAMES, Body, global_rotations
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample

__all__ = ["NdjsonOutput", "ndjson_line"]

TIME_DIGITS = 6
DIGITS = 7
"""A tenth of a micrometre: bone lengths from the file stay constant to 1e-6 m."""


def ndjson_line(pose: SkeletonPose, frame: int, start_s: float) -> str:
    """One frame as a line.

    Args:
        pose: of one person.
        frame: running number.
        start_s: time of the first frame.
    """
    quat_xyzw = to_quat_xyzw(global_rotations(pose.R_local[0]))
    joints = np.concatenate([pose.p_world[0], quat_xyzw], axis=-1)  # (22, 7)
    rows = (joints.round(DIGITS) + 0.0).tolist()  # + 0.0: no "-0.0"
    document = {
        "time_s": round(pose.time_s - start_s, TIME_DIGITS),
        "frame": frame,
        "joints": dict(zip(HUMANOID_NAMES, rows, strict=True)),
        "contact": pose.contact[0].tolist(),
        "roles": {role.value: report.state for role, report in pose.roles.items()},
    }
    return json.dumps(document, separators=(",", ":"), allow_nan=False) + "\n"


class NdjsonOutput:
    """Writes a line a frame; ``-`` is the standard output."""

    def __init__(self, target: str) -> None:
        """Choose a file, or ``-``."""
        self.target = target
        self._file: BinaryIO | None = None
        self._frame = 0
        self._start_s: float | None = None

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Create the file."""
        self._file = self._stdout() if self.target == "-" else create(Path(self.target))

    @staticmethod
    def _stdout() -> BinaryIO:
        """A handle of our own: when the reader goes away, closing it must not fail at exit."""
        try:
            sys.stdout.flush()
            return open(os.dup(sys.stdout.fileno()), "wb", buffering=0)
        except (OSError, ValueError) as error:
            raise OutputError(f"ndjson:- has no standard output to write to: {error}.") from error

    def calibrated(self, body: Body) -> None:
        """Nothing to do: positions are written as they are."""

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        """One line."""
        assert self._file is not None
        if self._start_s is None:
            self._start_s = pose.time_s
        _write_all(self._file, ndjson_line(pose, self._frame, self._start_s).encode("utf-8"))
        self._frame += 1

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None


def _write_all(file: BinaryIO, data: bytes) -> None:
    """An unbuffered write to a pipe may take only a part."""
    while data:
        data = data[file.write(data) or 0 :]
