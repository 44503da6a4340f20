"""The network, its kinematics and its losses."""

from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import pose_6d, toes_in_reference, true_lower_body
from lobstr_hw.rotations import Array, rotation_x
from lobstr_hw.skeleton import Joint
from lobstr_hw.training.config import LossWeights

if TYPE_CHECKING:
    from torch import Tensor

    from lobstr_hw.training.losses import Targets

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch


def poses() -> Array:
    """(frames, 2, 4, 3, 3) of a walk."""
    walk = walking(1.0)
    return true_lower_body(walk.R_local, reference_frames(walk.R_local[:, Joint.HIPS]))


def batch(joints: Array) -> "Tensor":
    pose: Tensor = torch.from_numpy(pose_6d(joints).astype(np.float32))
    return pose


def targets(pose: "Tensor", contact: int = 1) -> "Targets":
    from lobstr_hw.training.losses import Targets

    labels = torch.full((len(pose), 2), contact, dtype=torch.int64)
    return Targets(pose, pose.roll(1, 0), labels)


def test_the_papers_network_has_the_papers_number_of_parameters() -> None:
    from lobstr_hw.training.network import LobstrNetwork, parameter_count

    assert parameter_count(LobstrNetwork(1024, torch.zeros(48))) == 3_403_444


def test_carrying_the_state_frame_by_frame_is_the_same_as_a_window() -> None:
    from lobstr_hw.training.network import LobstrNetwork

    torch.manual_seed(0)
    network = LobstrNetwork(32, torch.zeros(48))
    x = torch.randn(3, 20, 37)
    with torch.no_grad():
        pose, contact, _ = network(x, last_only=False)
        hidden = None
        for i in range(20):
            step, step_contact, hidden = network(x[:, i : i + 1], hidden)
            assert torch.allclose(step, pose[:, i], atol=1e-6)
            assert torch.allclose(step_contact, contact[:, i], atol=1e-6)


def test_an_untrained_head_stands_around_the_mean_pose() -> None:
    from lobstr_hw.training.network import LobstrNetwork

    mean = torch.linspace(-50.0, 50.0, 48)
    pose, _, _ = LobstrNetwork(16, mean)(torch.zeros(2, 5, 37))
    assert (pose - mean).abs().max() < 1.0


def test_the_kinematics_are_those_of_the_ground_floor() -> None:
    from lobstr_hw.training import kinematics

    joints = poses()
    toes = kinematics.toes_in_reference(batch(joints)).numpy()
    assert toes == pytest.approx(toes_in_reference(joints), abs=1e-5)
    R = kinematics.rotations_from_6d(batch(joints)).numpy()
    assert joints == pytest.approx(R, abs=1e-5)


def test_the_truth_costs_nothing_but_its_contacts() -> None:
    from lobstr_hw.training.losses import losses

    pose = batch(poses())
    sure = torch.tensor([[-20.0, 20.0, -20.0, 20.0]]).repeat(len(pose), 1)
    right = losses(pose, sure, targets(pose, 1), LossWeights())
    assert right.total.item() == pytest.approx(0.0, abs=1e-4)
    wrong = losses(pose, sure, targets(pose, 0), LossWeights())
    assert wrong.contact.item() == pytest.approx(40.0)
    assert wrong.total.item() == pytest.approx(right.total.item() + 40e-6, abs=1e-6)


def test_turning_only_a_foot_changes_the_toe_loss() -> None:
    """The toe base is past the foot joint: a loss on the ankle would not feel it."""
    from lobstr_hw.training.losses import losses

    joints = poses()
    turned = joints.copy()
    turned[:, 1, 3] = turned[:, 1, 3] @ rotation_x(0.3)
    truth, logits = batch(joints), torch.zeros(len(joints), 4)
    terms = losses(batch(turned), logits, targets(truth), LossWeights())
    expected = np.linalg.norm(toes_in_reference(turned) - toes_in_reference(joints), axis=-1).mean()
    assert expected > 0.01
    assert terms.toe.item() == pytest.approx(expected, rel=1e-3)


def test_the_printed_velocity_loss_starts_at_the_true_step_before() -> None:
    """So it equals the toe loss; the paper's own ablation shows that it adds nothing."""
    from lobstr_hw.training.losses import losses

    joints = poses()
    turned = joints @ rotation_x(0.1)
    terms = losses(
        batch(turned), torch.zeros(len(joints), 4), targets(batch(joints)), LossWeights()
    )
    assert terms.velocity.item() == pytest.approx(terms.toe.item(), rel=1e-4)


def test_the_gradient_is_finite_at_the_truth() -> None:
    from lobstr_hw.training.losses import losses

    pose = batch(poses()).requires_grad_()
    terms = losses(pose, torch.zeros(len(pose), 4), targets(pose.detach()), LossWeights())
    (gradient,) = torch.autograd.grad(terms.total, pose)
    assert torch.isfinite(gradient).all()
