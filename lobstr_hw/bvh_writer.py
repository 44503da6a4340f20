"""The pieces of a BVH file, so that a recording can write frame by frame.

Centimetres and degrees; six channels at the root (Xposition Yposition Zposition Zrotation
Xrotation Yrotation), three (Zrotation Xrotation Yrotation) elsewhere.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lobstr_hw.rotations import Array, to_euler
from lobstr_hw.skeleton import HUMANOID_NAMES, PARENTS, STANDARD_OFFSETS, TOE_TIP, Joint

__all__ = ["FRAMES_WIDTH", "hierarchy", "motion_head", "motion_line", "write_bvh"]

FRAMES_WIDTH = 12
"""Columns of the frame count, so that a recording can write the true count over it at its end."""

_END_SITES = {
    "Head": (0.0, 12.0, 0.0),
    "LeftHand": (16.0, 0.0, 0.0),
    "RightHand": (-16.0, 0.0, 0.0),
    "LeftToes": tuple(100.0 * TOE_TIP),
    "RightToes": tuple(100.0 * TOE_TIP),
}
_ROOT_CHANNELS = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
_CHANNELS = "CHANNELS 3 Zrotation Xrotation Yrotation"


def hierarchy(
    names: Sequence[str] = HUMANOID_NAMES,
    parents: Sequence[int] = PARENTS,
    offsets_cm: Array | None = None,
) -> str:
    """The HIERARCHY section, up to and without MOTION.

    Args:
        names: of the joints, parents before children, in depth-first order.
        parents: index of each joint's parent, -1 at the root.
        offsets_cm: (joints, 3); the standard skeleton's when left out.
    """
    offsets = 100.0 * STANDARD_OFFSETS if offsets_cm is None else np.asarray(offsets_cm)
    lines = ["HIERARCHY"]
    for joint, parent in enumerate(parents):
        if parent < 0:
            _open(lines, 0, f"ROOT {names[joint]}", offsets[joint], _ROOT_CHANNELS)
            _children(lines, 1, joint, names, parents, offsets)
            lines.append("}")
    return "\n".join(lines) + "\n"


def _children(
    lines: list[str],
    depth: int,
    parent: int,
    names: Sequence[str],
    parents: Sequence[int],
    offsets: Array,
) -> None:
    children = [j for j, p in enumerate(parents) if p == parent]
    for joint in children:
        _open(lines, depth, f"JOINT {names[joint]}", offsets[joint], _CHANNELS)
        _children(lines, depth + 1, joint, names, parents, offsets)
        lines.append("\t" * depth + "}")
    if not children:
        tip = np.array(_END_SITES.get(names[parent], (0.0, 0.0, 0.0)))
        _open(lines, depth, "End Site", tip, None)
        lines.append("\t" * depth + "}")


def _open(lines: list[str], depth: int, title: str, offset: Array, channels: str | None) -> None:
    tabs = "\t" * depth
    lines += [f"{tabs}{title}", f"{tabs}{{", f"{tabs}\tOFFSET {_numbers(offset)}"]
    if channels:
        lines.append(f"{tabs}\t{channels}")


def _numbers(values: Array) -> str:
    # 1e-7 cm and 1e-7 degrees: read back, lengths and turns are right to 2e-9
    return " ".join(f"{v:.7f}" for v in np.ravel(values) + 0.0)


def motion_head(frames: int, frame_time_s: float) -> str:
    """The MOTION lines before the first frame; the count is padded to :data:`FRAMES_WIDTH`."""
    return f"MOTION\nFrames: {frames:<{FRAMES_WIDTH}d}\nFrame Time: {frame_time_s:.10f}\n"


def motion_line(p_root_cm: Array, R_local: Array) -> str:
    """One frame, with its line end.

    Args:
        p_root_cm: (3,) the root in the world.
        R_local: (joints, 3, 3) each joint in its parent, the root in the world.
    """
    return _numbers(np.append(p_root_cm, np.degrees(to_euler("ZXY", R_local)))) + "\n"


def write_bvh(
    path: str | Path,
    p_root: Array,
    R_local: Array,
    rate_hz: float,
    offsets: Array = STANDARD_OFFSETS,
    names: Sequence[str] = HUMANOID_NAMES,
    parents: Sequence[int] = PARENTS,
) -> None:
    """Write a whole clip.

    Args:
        path: of the file.
        p_root: (frames, 3) metres.
        R_local: (frames, joints, 3, 3) each joint in its parent, the root in the world.
        rate_hz: frames per second.
        offsets: (joints, 3) metres, in the joint order of ``names``.
        names: of the joints.
        parents: of the joints.
    """
    order = _depth_first(parents)
    body = [motion_line(100.0 * p, R[order]) for p, R in zip(p_root, R_local, strict=True)]
    text = hierarchy(names, parents, 100.0 * np.asarray(offsets))
    text += motion_head(len(body), 1.0 / rate_hz) + "".join(body)
    Path(path).write_text(text, encoding="utf-8", newline="\n")


def _depth_first(parents: Sequence[int]) -> list[int]:
    """The order in which :func:`hierarchy` writes the joints."""
    order: list[int] = []

    def visit(parent: int) -> None:
        for joint, p in enumerate(parents):
            if p == parent:
                order.append(joint)
                visit(joint)

    visit(-1)
    return order


assert _depth_first(PARENTS) == list(Joint), "motion_line takes the skeleton's order as it is"
