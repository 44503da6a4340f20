"""``bvh:FILE``: a motion file for Blender, Maya, MotionBuilder and the like, in centimetres."""

from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from lobstr_hw.bvh_writer import FRAMES_WIDTH, hierarchy, motion_head, motion_line
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.outputs.files import create
from lobstr_hw.skeleton import HUMANOID_NAMES, PARENTS, Body
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample

__all__ = ["BvhOutput"]

CENTIMETRES = 100.0
BATCH_S = 0.5
"""Frames are written together this often, each time with the new count: a killed program leaves a
whole file that lacks at most this much."""


class _Waiting:
    """Frames before the calibration; small, for it may be hours away and nobody moves meanwhile."""

    def __init__(self) -> None:
        self._p = array("d")
        self._runs: list[tuple[int, Array]] = []  # each array of rotations with its first frame

    def add(self, p_hips: Array, R_local: Array) -> None:
        if not self._runs or self._runs[-1][1] is not R_local:
            self._runs.append((len(self._p) // 3, R_local))
        self._p.extend(p_hips.tolist())

    def __iter__(self) -> Iterator[tuple[Array, Array]]:
        p = np.array(self._p).reshape(-1, 3)
        starts = [first for first, _ in self._runs] + [len(p)]
        for (first, R_local), end in zip(self._runs, starts[1:], strict=True):
            for i in range(first, end):
                yield p[i], R_local[0]


class BvhOutput:
    """Writes the skeleton at the first calibration, and gives the frames before it the same body.

    Each frame sent is one frame of the file; a tick that the loop skipped is missing here too.
    """

    def __init__(self, path: Path) -> None:
        """Choose the file; nothing is touched yet."""
        self.path = path
        self._file: BinaryIO | None = None
        self._lines: list[str] = []
        self._frames = 0
        self._early = _Waiting()
        self._written = False

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Create the file."""
        self._body = body
        self._rate_hz = rate_hz
        self._batch = max(1, round(BATCH_S * rate_hz))
        self._file = create(self.path)

    def calibrated(self, body: Body) -> None:
        """Write the skeleton, and the frames that waited for it."""
        grown = self._body.scale[0] / body.scale[0]
        self._body = body
        self._begin()
        for p_hips, R_local in self._early:
            self._add(p_hips * (1.0, grown, 1.0), R_local)
        self._early = _Waiting()

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        """One frame."""
        if self._written:
            self._add(pose.p_world[0, 0], pose.R_local[0])
        else:
            self._early.add(pose.p_world[0, 0], pose.R_local)

    def close(self) -> None:
        """Write the last frames; without a calibration, all of them on the standard body."""
        if self._file is None:
            return
        if not self._written:
            self.calibrated(self._body)
        self._flush()
        self._file.close()
        self._file = None

    def _begin(self) -> None:
        assert self._file is not None
        offsets_cm = np.array(self._body.offsets[0]) * CENTIMETRES
        offsets_cm[0] = 0.0  # the root's place is in its channels
        text = hierarchy(HUMANOID_NAMES, PARENTS, offsets_cm)
        head = text + motion_head(0, 1.0 / self._rate_hz)
        self._count_at = head.index("Frames: ") + len("Frames: ")  # ASCII: characters are bytes
        self._file.write(head.encode("utf-8"))
        self._written = True

    def _add(self, p_hips: Array, R_local: Array) -> None:
        self._lines.append(motion_line(p_hips * CENTIMETRES, R_local))
        self._frames += 1
        if len(self._lines) >= self._batch:
            self._flush()

    def _flush(self) -> None:
        assert self._file is not None
        self._file.write("".join(self._lines).encode("utf-8"))
        self._lines.clear()
        end = self._file.tell()
        self._file.seek(self._count_at)
        self._file.write(f"{self._frames:<{FRAMES_WIDTH}d}".encode())
        self._file.seek(end)
