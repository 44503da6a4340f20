"""Pictures of one clip: its error over time, its contacts, and a strip of its legs."""

from pathlib import Path
from typing import Any

import numpy as np

from lobstr_hw.evaluation.after_ik import Shown, show
from lobstr_hw.evaluation.metrics import network_legs
from lobstr_hw.evaluation.rollout import Mode, Rollout, roll_out
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.lower_body import leg_points_in_reference
from lobstr_hw.predictors import Predictor

__all__ = ["plot_clip"]

SHOWN_S = 12.0
STRIP_FRAMES = 10
STRIP_STEP_S = 0.2
COLOURS = {"truth": "0.55", "network": "tab:orange", "after IK": "tab:blue"}


def plot_clip(folder: Path, clip: Truth, predictor: Predictor, mode: Mode = "carried") -> None:
    """Write ``error_over_time.png``, ``contacts.png`` and ``legs.png`` of one clip.

    Args:
        folder: is made where it is not.
        clip: the truth.
        predictor: is run over it, and its answer through lock, floor and IK.
        mode: as for the scores.
    """
    folder.mkdir(parents=True, exist_ok=True)
    said = roll_out(predictor, [clip], mode)[0]
    after = show(predictor.card, [clip], [said])[0]
    _plot_errors(folder / "error_over_time.png", clip, said, after)
    _plot_contacts(folder / "contacts.png", clip, said, after)
    _plot_legs(folder / "legs.png", clip, said, after)


def _plot_errors(path: Path, clip: Truth, said: Rollout, after: Shown) -> None:
    figure, axes = _figure(1, 3.0)
    times = np.arange(len(clip)) / clip.rate_hz
    network = network_legs(clip, said.joints, said.contact)
    for name, toes in (("network", network.p_toes), ("after IK", after.p_toes)):
        error = 100.0 * np.linalg.norm(toes - clip.p_toes, axis=-1).mean(-1)
        axes[0].plot(times, error, color=COLOURS[name], linewidth=1.0, label=name)
    axes[0].set(xlabel="s", ylabel="toes, cm", title=clip.name, ylim=(0.0, None))
    axes[0].legend()
    figure.savefig(path, dpi=120)


def _plot_contacts(path: Path, clip: Truth, said: Rollout, after: Shown) -> None:
    figure, axes = _figure(2, 3.4)
    part = slice(0, round(SHOWN_S * clip.rate_hz))
    times = np.arange(len(clip))[part] / clip.rate_hz
    for side, ax in enumerate(axes):
        rows = {"after IK": after.locked, "network": said.contact > 0.5, "truth": clip.contact}
        for y, (name, on) in enumerate(rows.items()):
            ax.fill_between(
                times, y, y + 0.8 * on[part, side], step="post", color=COLOURS[name], linewidth=0
            )
        ax.plot(times, 1.0 + 0.8 * said.contact[part, side], color="black", linewidth=0.7)
        ax.set_yticks([0.4, 1.4, 2.4], [f"{name}, {('left', 'right')[side]}" for name in rows])
    axes[0].set_title(f"{clip.name}: on the floor (line: the network's probability)")
    axes[1].set_xlabel("s")
    figure.savefig(path, dpi=120)


def _plot_legs(path: Path, clip: Truth, said: Rollout, after: Shown) -> None:
    """From the side, in the heading: Z to the right, the frames side by side."""
    figure, axes = _figure(1, 3.4)
    first = _liveliest(clip)
    frames = [first + round(k * STRIP_STEP_S * clip.rate_hz) for k in range(STRIP_FRAMES)]
    rows = {"truth": clip.joints, "network": said.joints, "after IK": after.joints}
    for k, frame in enumerate(f for f in frames if f < len(clip)):
        for name, joints in rows.items():
            points = leg_points_in_reference(joints[frame])
            for side, style in ((0, "-"), (1, "--")):
                axes[0].plot(
                    points[side, :, 2] + 0.9 * k,
                    points[side, :, 1] + clip.p_hips[frame, 1],
                    style,
                    color=COLOURS[name],
                    linewidth=3.0 if name == "truth" else 1.2,
                    label=name if k == side == 0 else None,
                )
    axes[0].set_aspect("equal")
    axes[0].set(title=f"{clip.name}: a frame every {STRIP_STEP_S:g} s, the right leg dashed")
    axes[0].set(xticks=[], ylabel="m")
    axes[0].legend(loc="upper right", fontsize="small")
    figure.savefig(path, dpi=120)


def _liveliest(clip: Truth) -> int:
    """Where the feet move most over the length of a strip."""
    length = round(STRIP_FRAMES * STRIP_STEP_S * clip.rate_hz)
    speed = np.linalg.norm(np.diff(clip.p_toes, axis=0), axis=-1).sum(-1)
    way = np.convolve(speed, np.ones(min(length, max(len(speed), 1))), "valid")
    return int(way.argmax()) if len(way) else 0


def _figure(rows: int, height: float) -> tuple[Any, list[Any]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)
    return figure, list(axes[:, 0])
