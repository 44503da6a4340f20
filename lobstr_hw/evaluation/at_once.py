"""Clips as recordings: every frame of a clip is known when the networks are asked."""

from collections.abc import Callable, Sequence

import numpy as np

from lobstr_hw.evaluation.rollout import Rollout
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.features import POINT_ROLES, clip_points
from lobstr_hw.predictors.lobstr import Lobstr
from lobstr_hw.predictors.refined import refined_prediction
from lobstr_hw.predictors.two_way import TwoWay
from lobstr_hw.trackers import FOUR_POINTS

__all__ = ["roll_out_at_once"]

_ORDER = [FOUR_POINTS.index(role) for role in POINT_ROLES]


def roll_out_at_once(
    two_way: TwoWay,
    live: Lobstr,
    clips: Sequence[Truth],
    count: Callable[[int], None] = lambda frames: None,
) -> list[Rollout]:
    """What ``lobstr-log export --refine`` would make of clips.

    Trackers are made from the truth without noise.

    Args:
        two_way: the network for recordings.
        live: the one that is asked beside it.
        clips: at its rate.
        count: told of frames done.
    """
    out = []
    for clip in clips:
        points = clip_points(clip.p[:, _ORDER], clip.R[:, _ORDER])
        said = refined_prediction(points, np.arange(len(clip)) > 0, live, two_way)
        if said.C is None:
            raise AssertionError("the network gives C")
        out.append(Rollout(said.R, said.C, said.contact))
        count(len(clip))
    return out
