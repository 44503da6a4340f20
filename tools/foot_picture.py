"""Draw where the toe bases are over time: the network's, the shown ones with their lock, the true.

python tools/foot_picture.py DATA [--part validation] [--predictor NAME] [--out PICTURE.png]

DATA is the folder with one folder per set. The stretch is the longest walk in that part of the
split, of six seconds at most.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from split_clips import truths

from lobstr_hw.evaluation.activities import Activity, activities
from lobstr_hw.evaluation.after_ik import Shown, show
from lobstr_hw.evaluation.metrics import network_legs
from lobstr_hw.evaluation.rollout import Rollout, roll_out
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.predictors import load_predictor
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array
from lobstr_hw.splits import PARTS

LONGEST_S = 6.0
SKIPPED_S = 1.0
OUT = Path(__file__).parent.parent / "docs" / "pictures" / "foot_lock.png"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--part", choices=PARTS, default="test")
    parser.add_argument("--predictor", default="lobstr")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    clip, frames = longest_walk(list(truths(options.data, options.part)))
    predictor = load_predictor(options.predictor)
    said = roll_out(predictor, [clip], "carried")[0]
    shown = show(predictor.card, [clip], [said])[0]
    draw(options.out, clip, said, shown, frames)
    print(f"{options.out}: {clip.name} from {frames.start / clip.rate_hz:.1f} s")


def longest_walk(clips: list[Truth]) -> tuple[Truth, slice]:
    """The clip, and the frames of its longest stretch of walking, of LONGEST_S at most."""
    best, where = 0, (clips[0], slice(0, 0))
    for clip in clips:
        walks = activities(clip) == Activity.WALKING
        walks[: round(SKIPPED_S * clip.rate_hz)] = False
        edges = np.flatnonzero(np.diff(np.concatenate([[False], walks, [False]])))
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            if end - start > best:
                best = end - start
                where = clip, slice(start, min(end, start + round(LONGEST_S * clip.rate_hz)))
    return where


def draw(path: Path, clip: Truth, said: Rollout, shown: Shown, frames: slice) -> None:
    """Two rows for each foot: how far along the way, and how high."""
    network = network_legs(clip, said.joints, said.contact).p_toes
    way = clip.p_hips[frames.stop - 1] - clip.p_hips[frames.start]
    way = way * [1.0, 0.0, 1.0] / np.hypot(way[0], way[2])
    lines = [
        ("network", network[frames], "tab:orange"),
        ("shown", shown.p_toes[frames], "tab:blue"),
        ("true", clip.p_toes[frames], "black"),
    ]
    times = np.arange(frames.start, frames.stop) / clip.rate_hz
    figure = Figure(figsize=(11.0, 9.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(4, 1, sharex=True, height_ratios=[3, 1, 3, 1])
    for side, name in enumerate(("left", "right")):
        along, high = axes[2 * side], axes[2 * side + 1]
        for label, p, colour in lines:
            along.plot(times, p[:, side] @ way, color=colour, label=label, lw=1.3)
            high.plot(times, 100.0 * p[:, side, 1], color=colour, lw=1.3)
        shade(along, times, shown.locked[frames, side], "tab:blue", (0.0, 0.04))
        shade(along, times, clip.contact[frames, side], "black", (0.05, 0.09))
        along.set_ylabel(f"{name} toe base,\nmetres along the way")
        high.set_ylabel("cm high")
    axes[0].legend(loc="upper left")
    axes[0].set_title(f"{clip.name}; bars: locked (blue), truly in contact (black)")
    axes[-1].set_xlabel("seconds")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)


def shade(axes: Axes, times: Array, on: Bools, colour: str, height: tuple[float, float]) -> None:
    """A bar at the foot of the axes where something is so."""
    at = axes.get_xaxis_transform()
    axes.fill_between(times, *height, where=on, color=colour, alpha=0.6, transform=at, lw=0)


if __name__ == "__main__":
    main()
