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

from lobstr_hw.bvh import read_bvh
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import ClipFile, find_clips, retarget
from lobstr_hw.retargeting.agreement import walking_frames
from lobstr_hw.rotations import Array, heading
from lobstr_hw.skeleton import EYES, HEEL, PARENTS, TOE_TIP, Joint

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
    frames = _key_frames(motion)
    scale = float(clip.metres_per_unit or 1.0) / motion.metres
    figure, axes = plt.subplots(2, 2, figsize=(11, 6.2), sharey=True, width_ratios=(3, 2))
    for row, title in enumerate((f"{clip.name}: the rig", "standard skeleton")):
        for column, view in enumerate(("from the right", "from the front")):
            ax = axes[row][column]
            ax.axhline(0.0, color="0.7", lw=1)
            ax.set_aspect("equal")
            ax.set_title(f"{title}, {view}", fontsize=8)
            ax.tick_params(labelsize=6)
            for k, i in enumerate(frames):
                turn = heading(R[i, Joint.HIPS]).T
                at = np.array([(0.8 if column else 0.9) * k, 0.0, 0.0])
                if row == 0:
                    j = min(round(i / motion.rate_hz / bvh.frame_time_s), len(bvh) - 1)
                    q, lines = p_rig[j] * scale, _rig_lines(bvh.names, bvh.parents)
                    # the rig's own floor and place: shown as retargeting moved it
                    toes = [n for n, name in enumerate(bvh.names) if "toe" in name.lower()]
                    q = q - [0.0, q[toes[:2], 1].mean() - motion.p_toes[i, :, 1].mean(), 0.0]
                    centre = q[_root(bvh.names)]
                else:
                    q, lines = _skeleton(p[i], R[i])
                    centre = q[0]
                q = (q - centre * [1, 0, 1]) @ turn.T
                _stick(ax, q, lines, column, at)
    figure.tight_layout()
    figure.savefig(path, dpi=60, pil_kwargs={"optimize": True})
    plt.close(figure)


def _key_frames(motion: Motion) -> list[int]:
    """Eight frames over a second and a half of walking, or over the clip."""
    walk = np.flatnonzero(walking_frames(motion))
    if len(walk) < 45:
        return [int(i) for i in np.linspace(0, len(motion) - 1, 8)]
    start = walk[len(walk) // 3]
    return [int(i) for i in np.linspace(start, min(start + 60, len(motion) - 1), 8)]


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
    extra = []
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


def _stick(ax: Axes, q: Array, lines: list[tuple[int, int, str]], column: int, at: Array) -> None:
    """Seen from the right (Z to the right) or from the front (the left hand on the right)."""
    across = 0 if column else 2
    for a, b, colour in lines:
        ax.plot(
            [q[a, across] + at[0], q[b, across] + at[0]],
            [q[a, 1], q[b, 1]],
            color=colour,
            lw=1.2,
            marker=".",
            ms=2.5,
        )


if __name__ == "__main__":
    sys.exit(main())
