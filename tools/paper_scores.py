"""Scores of the tables' networks on recorded clips, and what a step costs.

All kinds are asked as the paper does it: windows of 45 frames, each from zero. A window costs as
much as 45 steps, so of each clip one second in every few is scored; the same for every row.
"""

import json
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import torch
from paper_rows import Trained

from lobstr_hw.evaluation.metrics import Scores, Tally, network_legs, tally
from lobstr_hw.evaluation.rollout import Rollout
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.features import POINT_ROLES, clip_features, clip_points, input_size
from lobstr_hw.predictors.lobstr import prediction_from_6d
from lobstr_hw.predictors.weights import load_network
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import FOUR_POINTS
from lobstr_hw.training.config import STEPPED_KINDS
from lobstr_hw.training.export import export_network
from lobstr_hw.training.shipping import network_card
from lobstr_hw.training.windowed import Outputs, windowed

SECOND = 45
_ORDER = [FOUR_POINTS.index(role) for role in POINT_ROLES]


@dataclass(frozen=True)
class Cost:
    """Of one output at batch 1 on one core, milliseconds of processor time."""

    window_ms: float
    step_ms: float | None


def scores(
    row: Trained, clips: Callable[[], Sequence[Truth]], every_s: float, kept: Path
) -> Scores:
    """Of one second in every so many; kept in a file, and read from there if still true."""
    said = {"steps": row.run.step, "every_s": every_s}
    if kept.is_file():
        document = json.loads(kept.read_text(encoding="utf-8"))
        if {name: document[name] for name in said} == said:
            return dict(document["scores"])
    total = sum((_clip_tally(row, clip, every_s) for clip in clips()), Tally())
    kept.parent.mkdir(parents=True, exist_ok=True)
    document = {**said, "scores": total.scores()}
    kept.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return total.scores()


def _clip_tally(row: Trained, clip: Truth, every_s: float) -> Tally:
    form = row.config.feature_form
    x = clip_features(clip_points(clip.p[:, _ORDER], clip.R[:, _ORDER], form=form), form)
    total = Tally()
    for first in range(SECOND, len(clip) - 1, round(every_s * SECOND)):
        end = min(first + SECOND, len(clip))
        joints, contact = legs_of(windowed(row.run, row.config, x, first, end))
        piece = _piece(clip, first - SECOND, end)
        # the second before is not scored: the truth stands for it
        joints = np.concatenate([piece.joints[:SECOND], joints])
        contact = np.concatenate([np.zeros((SECOND, 2)), contact])
        total += tally(piece, network_legs(piece, joints, contact))
    return total


def _piece(clip: Truth, first: int, end: int) -> Truth:
    arrays = [f.name for f in fields(Truth) if f.name not in ("name", "rate_hz")]
    return replace(clip, **{name: getattr(clip, name)[first:end] for name in arrays})


def legs_of(outputs: Outputs) -> tuple[Array, Array]:
    """Joints C, U, L, F (frames, 2, 4, 3, 3) and contact probabilities (frames, 2)."""
    said = prediction_from_6d(outputs.pose, outputs.logits)
    if said.C is None:
        raise AssertionError("the network gives C")
    return Rollout(said.R, said.C, said.contact).joints, said.contact


def cost_of(row: Trained) -> Cost:
    """Measured on random input; processor time, so that other work does not count."""
    window = torch.randn(1, row.config.window, input_size(row.config.feature_form))
    with torch.no_grad():
        window_ms = _mean_ms(lambda: row.run.network(window), 40)
    if row.config.network not in STEPPED_KINDS:
        return Cost(window_ms, None)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "row.onnx"
        export_network(row.run.network, network_card(row.run, row.config, {}), path)
        network = load_network(path)
        x, h = (np.zeros((1, n), np.float32) for n in (window.shape[-1], network.card.hidden_size))
        return Cost(window_ms, _mean_ms(lambda: network.step(x, h), 400))


def _mean_ms(call: Callable[[], object], times: int) -> float:
    torch.set_num_threads(1)
    call()
    began = time.process_time()
    for _ in range(times):
        call()
    return 1e3 * (time.process_time() - began) / times
