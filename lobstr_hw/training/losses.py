"""The four losses of the paper (section 3.3), as printed.

The paper does not say how its norms are averaged. Here: the mean over the batch and, for the L1
norm, over the 48 numbers; for the L2 norms, of the two toe bases' distances in metres.
"""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import cross_entropy

from lobstr_hw.training.config import LossWeights
from lobstr_hw.training.kinematics import toes_in_reference

__all__ = ["Losses", "Targets", "losses"]


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """The truth of a batch.

    Attributes:
        pose: (n, 48) now.
        pose_before: (n, 48) one step ago.
        contact: (n, 2) 0 or 1, integers.
    """

    pose: Tensor
    pose_before: Tensor
    contact: Tensor


@dataclass(frozen=True, slots=True, eq=False)
class Losses:
    """The four terms before weighting, and their weighted sum."""

    total: Tensor
    pose: Tensor
    toe: Tensor
    velocity: Tensor
    contact: Tensor


def losses(pose: Tensor, logits: Tensor, truth: Targets, weights: LossWeights) -> Losses:
    """Compare what the network says, pose (n, 48) and logits (n, 4), with the truth."""
    toes, true_toes = toes_in_reference(pose), toes_in_reference(truth.pose)
    toes_before = toes_in_reference(truth.pose_before)
    pose_term = (pose - truth.pose).abs().mean()
    toe_term = _distance(toes, true_toes)
    # as printed, both velocities start at the TRUE toes of the step before: equal to the toe term
    # but for the weight
    velocity_term = _distance(toes - toes_before, true_toes - toes_before)
    contact_term = _contact_term(logits, truth.contact)
    total = (
        weights.pose * pose_term
        + weights.toe * toe_term
        + weights.velocity * velocity_term
        + weights.contact * contact_term
    )
    return Losses(total, pose_term, toe_term, velocity_term, contact_term)


def _distance(a: Tensor, b: Tensor) -> Tensor:
    # the gradient of a norm is undefined at 0: a micrometre keeps it finite
    return torch.sqrt(((a - b) ** 2).sum(-1) + 1e-12).mean()


def _contact_term(logits: Tensor, contact: Tensor) -> Tensor:
    """Cross-entropy, the mean of left and right."""
    return cross_entropy(logits.reshape(-1, 2), contact.reshape(-1))
