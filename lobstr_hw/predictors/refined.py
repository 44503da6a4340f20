"""A recording's legs anew: both networks' mean where the two-way one can see, else the live one.

Where the two-way part begins or ends inside the recording, it is blended into what the live network
alone says there, as the same frames would have been shown live: nothing jumps.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from lobstr_hw.features import Points, features
from lobstr_hw.ik.vectors import smoothstep
from lobstr_hw.lost_points import seen_points
from lobstr_hw.predictors.lobstr import GAP_STEPS, Lobstr, prediction_from_6d
from lobstr_hw.predictors.mended import mended
from lobstr_hw.predictors.predictor import Bools, Frame, Prediction
from lobstr_hw.predictors.scripted import Scripted
from lobstr_hw.predictors.two_way import TwoWay
from lobstr_hw.rotations import Array

__all__ = ["SHORTEST_S", "clear_stretches", "refined", "refined_prediction"]

TWO_WAY_SHARE = 0.7
"""Of the mean; the rest is the live one's, which errs more, but otherwise (docs/experiments.md)."""
BLEND_S = 0.5
LOST_S = 1.5
"""Longer losses than in training are left to the live network; those that are mended are none."""
SHORTEST_S = 2.0
"""Of what is known without a break: in less there is not much future."""
_PELVIS, _HEAD = 0, 1


def refined(frames: Sequence[Frame], live: Lobstr, two_way: TwoWay) -> Scripted:
    """What a predictor is to say at the frames of one person's recording.

    Args:
        frames: n = 1, at the card's rate, oldest first; there may be gaps.
        live: says what would have been shown.
        two_way: the network for recordings.

    Raises:
        ValueError: there are no frames.
    """
    if not frames:
        raise ValueError("a recording without frames cannot be refined")
    rate_hz = live.card.rate_hz
    times_s = np.array([frame.time_s for frame in frames])
    linked = np.diff(times_s, prepend=-np.inf) * rate_hz < GAP_STEPS
    points = mended(_points(frames), linked)
    return Scripted(two_way.card, times_s, refined_prediction(points, linked, live, two_way))


def refined_prediction(points: Points, linked: Bools, live: Lobstr, two_way: TwoWay) -> Prediction:
    """What is to be said of one person's points (frames, 4, ...).

    Args:
        points: at the networks' rate.
        linked: (frames,) whether the frame before is one step ago.
        live: says what would have been shown.
        two_way: the network for recordings.
    """
    rate_hz = live.card.rate_hz
    pose, logits = _live(live, points, linked)
    for a, b in clear_stretches(points.valid_p & points.valid_R, linked, rate_hz):
        better = two_way.say(points.take(slice(a, b)))
        share = _share(b - a, rate_hz, comes=a > 0, goes_on=b < len(linked))[:, None]
        pose[a:b] += share * (better[0] - pose[a:b])
        logits[a:b] += share * (better[1] - logits[a:b])
    return prediction_from_6d(pose, logits)


def _points(frames: Sequence[Frame]) -> Points:
    """The points of all frames (frames, 4, ...)."""
    single = [seen_points(frame) for frame in frames]
    return Points(
        *(
            np.concatenate([getattr(one, name) for one in single])
            for name in ("p", "R", "valid_p", "valid_R", "R_ref")
        )
    )


def _live(live: Lobstr, points: Points, linked: Bools) -> tuple[Array, Array]:
    """What the live network says, its state carried over everything, gaps too."""
    card = live.network.card
    before = points.take(np.maximum(np.arange(len(linked)) - 1, 0))
    x = features(before, points, linked, card.feature_form)
    z = (x.astype(np.float32) - card.input_mean) / card.input_scale
    hidden = np.zeros((1, card.hidden_size), dtype=np.float32)
    poses, logits = [], []
    for row in z:
        hidden, pose, contact = live.network.step(row[None], hidden)
        poses.append(pose)
        logits.append(contact)
    return np.concatenate(poses).astype(np.float64), np.concatenate(logits).astype(np.float64)


def clear_stretches(valid: Bools, linked: Bools, rate_hz: float) -> Iterator[tuple[int, int]]:
    """Where the two-way network is asked: from and up to which frame.

    Args:
        valid: (frames, 4) which points were measured.
        linked: (frames,) whether the frame before is one step ago.
        rate_hz: of the frames.
    """
    lost = _long_runs(~(valid[:, _PELVIS] & valid[:, _HEAD]), LOST_S * rate_hz)
    edge = np.flatnonzero((np.diff(lost.astype(int), prepend=0) != 0) | ~linked)
    for a, b in zip(edge, [*edge[1:], len(lost)], strict=True):
        if not lost[a] and b - a >= SHORTEST_S * rate_hz:
            yield int(a), int(b)


def _long_runs(where: Bools, longest: float) -> Bools:
    """The same, but only where it holds for more than so many frames in a row."""
    change = np.flatnonzero(np.diff(where.astype(int), prepend=0, append=0))
    out = np.zeros_like(where)
    for a, b in change.reshape(-1, 2):
        out[a:b] = b - a > longest
    return out


def _share(frames: int, rate_hz: float, *, comes: bool, goes_on: bool) -> Array:
    """Of the two-way network over a stretch; at both ends of everything there is nothing to meet.

    Least of all at the first frame, where the live network has seen nothing yet: over the first
    0.1 s its toes are 17 cm off where the mean's are 13 (validation, clips cut anywhere).
    """
    at = np.arange(frames, dtype=np.float64)
    share = np.full(frames, TWO_WAY_SHARE)
    if comes:
        share = share * smoothstep(at, 0.0, BLEND_S * rate_hz)
    if goes_on:
        share = share * smoothstep(frames - 1.0 - at, 0.0, BLEND_S * rate_hz)
    return share
