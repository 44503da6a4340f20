"""Draw, per set, a source rig and the retargeted skeleton side by side: docs/pictures/SET.png.

python tools/render_sets.py OUT_FOLDER FOLDER...
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from PIL import Image

from lobstr_hw.bvh import read_bvh
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import ClipFile, find_clips, retarget
from lobstr_hw.retargeting.agreement import walking_frames
from lobstr_hw.rotations import Array, heading
from lobstr_hw.skeleton import EYES, HEEL, PARENTS, TOE_TIP, Joint

FRAMES, STEP_M = (7, 5), (0.95, 0.85)
LEFT, RIGHT, MIDDLE = "tab:blue", "tab:red", "0.3"


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw one picture a set."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--clip", help="draw this clip, not the one that walks most")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    for path in options.paths:
        clips = find_clips([path])
        motions = {m.name: m for m in retarget(clips) if "#" not in m.name}
        chosen = max(
            (m for m in motions.values() if not options.clip or m.name.endswith(options.clip)),
            key=lambda m: min(int(walking_frames(m).sum()), 150) - 0.01 * len(m),
        )
        clip = next(c for c in clips if c.name == chosen.name)
        draw(clip, chosen, options.out / f"{clip.set_name}.png")
    return 0


def draw(clip: ClipFile, motion: Motion, path: Path) -> None:
    """Key frames of one clip: the rig above, the standard skeleton below; side and front."""
    bvh = read_bvh(clip.path)
    p_rig, _ = bvh.world()
    p, R = motion.joints()
    scale = float(clip.metres_per_unit or 1.0) / motion.metres
    toes = [n for n, name in enumerate(bvh.names) if "toe" in name.lower()][:2]
    widths = [STEP_M[c] * FRAMES[c] for c in (0, 1)]
    figure, axes = plt.subplots(2, 2, figsize=(11, 5.6), sharey=True, width_ratios=widths)
    for column, view in enumerate(("from the right", "from the front")):
        for row, title in enumerate((f"{clip.name}: the rig", "standard skeleton")):
            ax = axes[row][column]
            ax.axhline(0.0, color="0.6", lw=0.8)
            ax.set_aspect("equal")
            ax.set_xlim(-0.5 * STEP_M[column], widths[column] - 0.5 * STEP_M[column])
            ax.set_ylim(-0.08, 1.85)
            ax.set_xticks([])
            ax.set_title(f"{title}, {view}", fontsize=8)
            ax.tick_params(labelsize=6)
        for k, i in enumerate(_key_frames(motion, FRAMES[column])):
            turn = heading(R[i, Joint.HIPS]).T
            at = STEP_M[column] * k
            j = min(round(i / motion.rate_hz / bvh.frame_time_s), len(bvh) - 1)
            rig = p_rig[j] * scale
            # the rig's own floor is elsewhere: stand it where retargeting put its toes
            rig = rig - [0.0, rig[toes, 1].mean() - motion.p_toes[i, :, 1].mean(), 0.0]
            own, lines = _skeleton(p[i], R[i])
            middle = rig[_root(bvh.names)]
            for row, (q, centre, bones) in enumerate(
                ((rig, middle, _rig_lines(bvh.names, bvh.parents)), (own, own[0], lines))
            ):
                _stick(axes[row][column], (q - centre * [1, 0, 1]) @ turn.T, bones, column, at)
    figure.tight_layout(pad=0.4)
    figure.savefig(path, dpi=80)
    plt.close(figure)
    # 16 colours are enough for lines and keep the repository small
    Image.open(path).convert("RGB").quantize(16).save(path, optimize=True)


def _key_frames(motion: Motion, count: int) -> list[int]:
    """Frames over a stride of walking, or over the clip where nobody walks."""
    walk = np.flatnonzero(walking_frames(motion))
    if len(walk) < 45:
        return [int(i) for i in np.linspace(0, len(motion) - 1, count)]
    start = walk[len(walk) // 3]
    return [int(i) for i in np.linspace(start, min(start + 54, len(motion) - 1), count)]


def _root(names: Sequence[str]) -> int:
    return 1 if names[0] == "joint_Root" else 0


def _rig_lines(names: Sequence[str], parents: Sequence[int]) -> list[tuple[int, int, str]]:
    root = _root(names)
    return [(p, j, _colour(names[j])) for j, p in enumerate(parents) if p >= root]


def _colour(name: str) -> str:
    low = name.lower()
    for colour, words in ((LEFT, ("left", "_l", "l_")), (RIGHT, ("right", "_r", "r_"))):
        if low.startswith(words[0]) or low.endswith(words[1]) or f"_{words[2]}" in low:
            return colour
    asf = ("femur", "tibia", "foot", "toes", "humerus", "radius", "wrist", "hand", "clavicle")
    if low[1:] in asf or low[1:] in ("hipjoint", "fingers", "thumb"):
        return LEFT if low[0] == "l" else RIGHT
    return MIDDLE


def _skeleton(p: Array, R: Array) -> tuple[Array, list[tuple[int, int, str]]]:
    """The 22 joints, with eyes, heels, toe tips and fingers."""
    lines = [(p_, j, _colour(Joint(j).name)) for j, p_ in enumerate(PARENTS) if p_ >= 0]
    extra: list[Array] = []
    for joint, offset in (
        (Joint.HEAD, EYES),
        (Joint.LEFT_FOOT, HEEL),
        (Joint.RIGHT_FOOT, HEEL),
        (Joint.LEFT_TOES, TOE_TIP),
        (Joint.RIGHT_TOES, TOE_TIP),
        (Joint.LEFT_HAND, np.array([0.1, 0.0, 0.0])),
        (Joint.RIGHT_HAND, np.array([-0.1, 0.0, 0.0])),
        (Joint.LEFT_HAND, np.array([0.04, 0.0, 0.06])),
        (Joint.RIGHT_HAND, np.array([-0.04, 0.0, 0.06])),
    ):
        lines.append((int(joint), 22 + len(extra), _colour(joint.name)))
        extra.append(p[joint] + R[joint] @ offset)
    return np.concatenate([p, extra]), lines


def _stick(ax: Axes, q: Array, lines: list[tuple[int, int, str]], column: int, at: float) -> None:
    """Seen from the right (Z to the right) or from the front (the left hand on the right)."""
    across = 0 if column else 2
    for a, b, colour in lines:
        ax.plot(
            [q[a, across] + at, q[b, across] + at],
            [q[a, 1], q[b, 1]],
            color=colour,
            lw=1.2,
            marker=".",
            ms=2.5,
        )


if __name__ == "__main__":
    sys.exit(main())
