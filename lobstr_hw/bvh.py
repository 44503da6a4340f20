"""Reading BVH files as they are found in the wild (writing: lobstr_hw/bvh_writer.py).

Tabs, CRLF, any channel order, joints with six channels, End Sites, a padded ``Frames:`` field and
fewer lines than it says are all read. A position channel replaces that coordinate of the joint's
OFFSET, for the root and for any other joint: every exporter met so far means it so.
"""

import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lobstr_hw.bvh_hierarchy import Layout, parse_hierarchy
from lobstr_hw.bvh_writer import hierarchy, motion_line, write_bvh
from lobstr_hw.errors import MotionFileError
from lobstr_hw.rotations import Array

__all__ = ["Bvh", "hierarchy", "motion_line", "read_bvh", "read_skeleton", "write_bvh"]


_MOTION = re.compile(r"^[ \t]*MOTION[ \t\r]*$", re.MULTILINE)
"""Alone on its line: a joint may have the word in its name."""


@dataclass(frozen=True, slots=True, eq=False)
class Bvh:
    """A motion file, in its own unit and axes.

    Attributes:
        names: of the J joints, parents before children.
        parents: index of each joint's parent, -1 at the root.
        offsets: (J, 3) each joint in its parent in the zero pose.
        R_local: (F, J, 3, 3) each joint in its parent.
        p_local: (F, J, 3) each joint in its parent: the offset, or what its channels say.
        frame_time_s: seconds from frame to frame.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    R_local: Array
    p_local: Array
    frame_time_s: float

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.R_local)

    def world(self) -> tuple[Array, Array]:
        """Positions (F, J, 3) in the file's unit and rotations (F, J, 3, 3), in the world by FK."""
        p, R = np.array(self.p_local), np.array(self.R_local)
        for j, parent in enumerate(self.parents):
            if parent >= 0:
                p[:, j] = p[:, parent] + (R[:, parent] @ p[:, j, :, None])[..., 0]
                R[:, j] = R[:, parent] @ R[:, j]
        return p, R


def read_skeleton(path: str | Path) -> tuple[tuple[str, ...], Array]:
    """Names (J) and offsets (J, 3) alone; zero where position channels replace the offset.

    Raises:
        MotionFileError: as :func:`read_bvh`.
    """
    layout = parse_hierarchy(_MOTION.split(_read_text(Path(path)), maxsplit=1)[0], Path(path))
    offsets = np.array(layout.offsets)
    offsets[[joint for joint, word in layout.channels if word.endswith("position")]] = 0.0
    return tuple(layout.names), offsets


def read_bvh(path: str | Path) -> Bvh:
    """Read one BVH file.

    Raises:
        MotionFileError: the file is missing or no BVH; the message names the line.
    """
    path = Path(path)
    text = _read_text(path)
    mark = _MOTION.search(text)
    head = text[: mark.start()] if mark else text
    if not mark:
        raise MotionFileError(
            f"{path}: line {head.count(chr(10)) + 1}: the file ends without a MOTION section. "
            "Is this a whole BVH file?"
        )
    layout = parse_hierarchy(head, path)
    first_line = head.count("\n") + 1
    motion = text[mark.end() :]
    frames, frame_time_s, numbers, line = _parse_motion_head(motion, path, first_line)
    values = _parse_numbers(numbers, len(layout.channels), path, line)[:frames]
    if not len(values):
        raise MotionFileError(
            f"{path}: line {line}: no frame of {len(layout.channels)} numbers after "
            "'Frame Time:'. Export the clip again."
        )
    return _assemble(layout, values, frame_time_s)


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise MotionFileError(f"{path}: cannot be read ({error}). Check the path.") from error


def _parse_motion_head(motion: str, path: Path, line: int) -> tuple[int, float, str, int]:
    """Frames, frame time, the numbers' text and the line on which they start."""
    rows = motion.split("\n", 3)
    try:
        label, _, frames = rows[1].partition(":")
        time_label, _, frame_time = rows[2].partition(":")
        if label.strip() != "Frames" or time_label.strip() != "Frame Time":
            raise ValueError("expected 'Frames: N' and 'Frame Time: seconds'")
        count, seconds = int(frames), float(frame_time)
        if count < 1 or not seconds > 0.0:
            raise ValueError(f"{count} frames of {seconds} s")
    except (ValueError, IndexError) as error:
        seen = " / ".join(r.strip()[:60] for r in rows[1:3])
        raise MotionFileError(
            f"{path}: line {line + 1}: after MOTION stands {seen!r} ({error}). "
            "Export the clip again as BVH."
        ) from error
    return count, seconds, rows[3] if len(rows) > 3 else "", line + 3


def _parse_numbers(text: str, channels: int, path: Path, line: int) -> Array:
    """The motion lines (frames, channels); an unfinished last line is left out."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)
            values = np.fromstring(text, sep=" ")
    except (DeprecationWarning, ValueError):
        values = np.array([np.nan])
    whole = len(values) // channels * channels
    if np.isfinite(values).all():
        return values[:whole].reshape(-1, channels)
    raise _bad_number(text, path, line)


def _bad_number(text: str, path: Path, line: int) -> MotionFileError:
    for number, row in enumerate(text.split("\n"), start=line):
        for word in row.split():
            try:
                good = bool(np.isfinite(float(word)))
            except ValueError:
                good = False
            if not good:
                return MotionFileError(
                    f"{path}: line {number}: {word!r} is no number. "
                    "Cut the file before this line or export the clip again."
                )
    return MotionFileError(f"{path}: the motion lines from {line} on cannot be read as numbers.")


def _assemble(layout: Layout, values: Array, frame_time_s: float) -> Bvh:
    frames, joints = len(values), len(layout.names)
    offsets = np.array(layout.offsets)
    p = np.repeat(offsets[None], frames, axis=0)
    angles: list[list[Array]] = [[] for _ in range(joints)]
    orders = ["" for _ in range(joints)]
    for column, (joint, word) in enumerate(layout.channels):
        if word.endswith("position"):
            p[:, joint, "XYZ".index(word[0])] = values[:, column]
        else:
            orders[joint] += word[0]
            angles[joint].append(np.radians(values[:, column]))
    R = np.empty((frames, joints, 3, 3))
    for joint, order in enumerate(orders):
        R[:, joint] = _turns(order, angles[joint], frames)
    return Bvh(tuple(layout.names), tuple(layout.parents), offsets, R, p, frame_time_s)


def _turns(order: str, angles: list[Array], frames: int) -> Array:
    """The product of turns about the axes in ``order``: columns are combined, no full matmul."""
    R = np.tile(np.eye(3), (frames, 1, 1))
    for axis, angle in zip(order, angles, strict=True):
        i = "XYZ".index(axis)
        j, k = (i + 1) % 3, (i + 2) % 3
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        a, b = R[:, :, j].copy(), R[:, :, k].copy()
        R[:, :, j], R[:, :, k] = c * a + s * b, c * b - s * a
    return R
