"""Laws of the network's eight joints."""

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import (
    JOINT_ORDER,
    POSE_SIZE,
    leg_points_in_reference,
    mirror_pose_6d,
    pose_6d,
    pose_from_6d,
    toes_in_reference,
    true_lower_body,
)
from lobstr_hw.motion import Motion, mirrored
from lobstr_hw.rotations import Array, from_rotation_vector
from lobstr_hw.skeleton import Joint


def truth(motion: Motion) -> tuple[Array, Array]:
    R_ref = reference_frames(motion.R_local[:, Joint.HIPS])
    return true_lower_body(motion.R_local, R_ref), R_ref


def test_there_are_eight_joints_of_six_numbers() -> None:
    assert len(set(JOINT_ORDER)) == 8
    assert POSE_SIZE == 48


def test_packing_and_unpacking_go_both_ways() -> None:
    joints, _ = truth(walking(1.0))
    assert pose_from_6d(pose_6d(joints)) == pytest.approx(joints)


def test_the_toes_of_the_truth_are_the_toes_of_the_skeleton() -> None:
    walk = walking(1.0)
    joints, R_ref = truth(walk)
    toes = walk.p_hips[:, None] + (R_ref[:, None] @ toes_in_reference(joints)[..., None])[..., 0]
    p, _ = walk.joints()
    assert toes == pytest.approx(p[:, [Joint.LEFT_TOES, Joint.RIGHT_TOES]])


def test_the_points_of_a_leg_end_at_the_toes_and_keep_their_lengths() -> None:
    joints = from_rotation_vector(np.random.default_rng(1).normal(scale=0.7, size=(5, 2, 4, 3)))
    points = leg_points_in_reference(joints)
    np.testing.assert_allclose(points[..., 3, :], toes_in_reference(joints), atol=1e-12)
    straight = leg_points_in_reference(np.broadcast_to(np.eye(3), joints.shape))
    bones, own = (np.linalg.norm(np.diff(p, axis=-2), axis=-1) for p in (points, straight))
    np.testing.assert_allclose(bones, own, atol=1e-12)


def test_mirrored_poses_are_the_poses_of_the_mirrored_motion() -> None:
    walk = walking(1.0)
    pose, other = pose_6d(truth(walk)[0]), pose_6d(truth(mirrored(walk))[0])
    assert mirror_pose_6d(pose) == pytest.approx(other, abs=1e-12)
    assert mirror_pose_6d(mirror_pose_6d(pose)) == pytest.approx(pose)
    assert np.abs(pose - other).max() > 0.1
