"""The losses of the recipe ``carried``: on every frame of a chunk, with a true velocity."""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from lobstr_hw.training.config import LossWeights
from lobstr_hw.training.kinematics import leg_points_in_reference
from lobstr_hw.training.losses import Losses

__all__ = ["ChunkTargets", "carried_losses", "distance", "toe_errors_in_world"]


@dataclass(frozen=True, slots=True, eq=False)
class ChunkTargets:
    """The truth of a chunk.

    Attributes:
        pose: (n, frames, 48).
        contact: (n, frames, 2) 0 or 1, or a teacher's probability.
        yaw: (n, frames) of the reference frame.
        counted: (n, frames) 1 where there is a loss, else 0.
    """

    pose: Tensor
    contact: Tensor
    yaw: Tensor
    counted: Tensor


def carried_losses(
    pose: Tensor, logits: Tensor, truth: ChunkTargets, weights: LossWeights
) -> Losses:
    """Compare what the network says, pose (n, frames, 48) and logits (n, frames, 4).

    The term ``toe`` is the mean distance of knees, ankles and toe bases. ``velocity`` is the norm
    of the difference of the toe bases' true and said movements from frame to frame in the world:
    unlike the paper's, it says something that the position does not.
    """
    errors = leg_points_in_reference(pose) - leg_points_in_reference(truth.pose)
    moved = torch.diff(toe_errors_in_world(errors[..., 2, :], truth.yaw), dim=1)
    pose_term = _mean((pose - truth.pose).abs().mean(-1), truth.counted)
    toe_term = _mean(distance(errors).mean((-1, -2)), truth.counted)
    velocity_term = _mean(distance(moved).mean(-1), truth.counted[:, 1:])
    contact_term = _mean(_cross_entropy(logits, truth.contact), truth.counted)
    total = (
        weights.pose * pose_term
        + weights.toe * toe_term
        + weights.velocity * velocity_term
        + weights.contact * contact_term
    )
    return Losses(total, pose_term, toe_term, velocity_term, contact_term)


def toe_errors_in_world(errors: Tensor, yaw: Tensor) -> Tensor:
    """Differences (..., 2, 3) in the reference frame, turned by its yaw (...) into the world."""
    c, s = torch.cos(yaw)[..., None], torch.sin(yaw)[..., None]
    x, y, z = errors.unbind(-1)
    return torch.stack([c * x + s * z, y, c * z - s * x], dim=-1)


def distance(difference: Tensor) -> Tensor:
    """Norm of (..., 3)."""
    # the gradient of a norm is undefined at 0: a micrometre keeps it finite
    return torch.sqrt((difference**2).sum(-1) + 1e-12)


def _mean(values: Tensor, counted: Tensor) -> Tensor:
    return (values * counted).sum() / counted.sum().clamp(min=1.0)


def _cross_entropy(logits: Tensor, contact: Tensor) -> Tensor:
    """(n, frames), the mean of both feet."""
    off, on = logits.reshape(*contact.shape, 2).unbind(-1)
    # a softmax of two is a logistic of their difference
    return binary_cross_entropy_with_logits(on - off, contact.float(), reduction="none").mean(-1)
