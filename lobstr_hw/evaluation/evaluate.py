"""Score a predictor on clips."""

from collections.abc import Callable, Sequence

from lobstr_hw.evaluation.after_ik import show
from lobstr_hw.evaluation.metrics import Legs, network_legs, tally
from lobstr_hw.evaluation.rollout import Mode, Rollout, roll_out
from lobstr_hw.evaluation.tables import ClipResult
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.predictors import ModelCard, Predictor

__all__ = ["compare", "evaluate"]


def evaluate(
    predictor: Predictor,
    clips: Sequence[Truth],
    mode: Mode = "carried",
    count: Callable[[int], None] = lambda frames: None,
) -> list[ClipResult]:
    """Run the network, then the avatar with what it said, and compare both with the truth.

    Args:
        predictor: gives the lower body.
        clips: at the predictor's rate.
        mode: see :func:`lobstr_hw.evaluation.rollout.roll_out`.
        count: told of frames done; each frame counts twice.
    """
    return compare(predictor.card, clips, roll_out(predictor, clips, mode, count), count)


def compare(
    card: ModelCard,
    clips: Sequence[Truth],
    said: Sequence[Rollout],
    count: Callable[[int], None] = lambda frames: None,
) -> list[ClipResult]:
    """What a predictor said over clips, and what the avatar shows of it, against the truth."""
    shown = show(card, clips, said, count)
    results = []
    for clip, network, after in zip(clips, said, shown, strict=True):
        legs = network_legs(clip, network.joints, network.contact)
        shown_legs = Legs(after.joints, after.p_toes, after.locked)
        results.append(ClipResult(clip.name, tally(clip, legs), tally(clip, shown_legs)))
    return results
