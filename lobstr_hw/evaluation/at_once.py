"""The network for recordings over clips: every frame of a clip is known when it is asked."""

from collections.abc import Callable, Sequence

from lobstr_hw.evaluation.rollout import Rollout
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.features import POINT_ROLES, clip_points
from lobstr_hw.predictors.lobstr import prediction_from_6d
from lobstr_hw.predictors.two_way import TwoWay
from lobstr_hw.trackers import FOUR_POINTS

__all__ = ["roll_out_at_once"]

_ORDER = [FOUR_POINTS.index(role) for role in POINT_ROLES]


def roll_out_at_once(
    two_way: TwoWay, clips: Sequence[Truth], count: Callable[[int], None] = lambda frames: None
) -> list[Rollout]:
    """Trackers are made from the truth without noise.

    Args:
        two_way: the network.
        clips: at its rate.
        count: told of frames done.
    """
    out = []
    for clip in clips:
        pose, logits = two_way.say(clip_points(clip.p[:, _ORDER], clip.R[:, _ORDER]))
        said = prediction_from_6d(pose, logits)
        if said.C is None:
            raise AssertionError("the network gives C")
        out.append(Rollout(said.R, said.C, said.contact))
        count(len(clip))
    return out
