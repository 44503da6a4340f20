"""Laws of the network's eight joints."""

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import (
    JOINT_ORDER,
    POSE_SIZE,
    mirror_pose_6d,
    pose_6d,
    pose_from_6d,
    toes_in_reference,
    true_lower_body,
)
from lobstr_hw.motion import Motion, mirrored
from lobstr_hw.rotations import Array
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


def test_mirrored_poses_are_the_poses_of_the_mirrored_motion() -> None:
    walk = walking(1.0)
    pose, other = pose_6d(truth(walk)[0]), pose_6d(truth(mirrored(walk))[0])
    assert mirror_pose_6d(pose) == pytest.approx(other, abs=1e-12)
    assert mirror_pose_6d(mirror_pose_6d(pose)) == pytest.approx(pose)
    assert np.abs(pose - other).max() > 0.1
