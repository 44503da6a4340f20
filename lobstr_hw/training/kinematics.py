"""The network's forward kinematics in torch: equal to lobstr_hw.lower_body, but differentiable."""

import torch
from torch import Tensor
from torch.nn.functional import normalize

from lobstr_hw.lower_body import LEG_JOINTS
from lobstr_hw.skeleton import STANDARD_OFFSETS

__all__ = ["leg_points_in_reference", "rotations_from_6d", "toes_in_reference"]

_OFFSETS = torch.tensor(
    [[list(STANDARD_OFFSETS[joint]) for joint in leg] for leg in LEG_JOINTS], dtype=torch.float32
)
"""(2, 4, 3): upper leg in hips, lower leg, foot, toes."""


def rotations_from_6d(pose: Tensor) -> Tensor:
    """48 numbers (..., 48) -> C, U, L, F of both sides (..., 2, 4, 3, 3)."""
    six = pose.reshape(*pose.shape[:-1], 2, 4, 6)
    z = normalize(six[..., :3], dim=-1)
    y = six[..., 3:]
    y = normalize(y - (y * z).sum(-1, keepdim=True) * z, dim=-1)
    return torch.stack([torch.linalg.cross(y, z), y, z], dim=-1)


def toes_in_reference(pose: Tensor) -> Tensor:
    """Toe bases (..., 2, 3) in the reference frame, from 48 numbers, on the standard skeleton."""
    R = rotations_from_6d(pose)
    offsets = _OFFSETS.to(pose.device, pose.dtype)
    p = offsets[:, 3]
    for i in (3, 2, 1):  # F, L, U
        p = offsets[:, i - 1] + (R[..., i, :, :] @ p[..., None])[..., 0]
    return (R[..., 0, :, :] @ p[..., None])[..., 0]


def leg_points_in_reference(pose: Tensor) -> Tensor:
    """Knee, ankle and toe base of both legs (..., 2, 3, 3) in the reference frame."""
    R = rotations_from_6d(pose)
    offsets = _OFFSETS.to(pose.device, pose.dtype)
    # all points of a leg are turned together: the columns of p are knee, ankle, toe base
    shape = (*R.shape[:-3], 3)
    ankle, toes = offsets[:, 2].expand(shape), offsets[:, 3].expand(shape)
    toes = offsets[:, 2] + (R[..., 3, :, :] @ toes[..., None])[..., 0]
    below_knee = R[..., 2, :, :] @ torch.stack([ankle, toes], dim=-1)
    knee = torch.zeros_like(below_knee[..., :1])
    p = offsets[:, 1, :, None] + torch.cat([knee, below_knee], dim=-1)
    p = offsets[:, 0, :, None] + R[..., 1, :, :] @ p
    return (R[..., 0, :, :] @ p).transpose(-1, -2)
