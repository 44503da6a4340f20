"""The standard skeleton and forward kinematics."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lobstr_hw import skeleton as sk
from lobstr_hw.skeleton import Body, Joint

REST = np.broadcast_to(np.eye(3), (22, 3, 3))
R_LOCAL = Rotation.random(22 * 5, random_state=1).as_matrix().reshape(5, 22, 3, 3)
P_HIPS = np.random.default_rng(1).normal(size=(5, 3))


def test_parents_come_before_children() -> None:
    assert all(parent < joint for joint, parent in enumerate(sk.PARENTS))


def test_the_names_outside_are_those_of_humanoid_avatars() -> None:
    assert sk.HUMANOID_NAMES[Joint.UPPER_CHEST] == "UpperChest"
    assert sk.HUMANOID_NAMES[Joint.LEFT_UPPER_LEG] == "LeftUpperLeg"
    assert len(set(sk.HUMANOID_NAMES)) == 22


def test_the_t_pose_stands_on_the_floor_and_has_the_stated_stature() -> None:
    p, _ = sk.forward_kinematics(REST, sk.STANDARD_OFFSETS[Joint.HIPS])
    assert p[Joint.LEFT_TOES, 1] == pytest.approx(sk.TOE_BASE_HEIGHT)
    assert p[Joint.RIGHT_FOOT, 1] + sk.HEEL[1] == pytest.approx(0.0, abs=1e-12)
    assert p[Joint.HEAD, 1] < sk.STATURE
    assert p[Joint.LEFT_HAND, 0] > 0.0  # left is +X, the figure faces +Z
    assert p[Joint.LEFT_TOES, 2] > p[Joint.LEFT_FOOT, 2]


def test_eyes_and_hips_stand_where_the_priors_of_calibration_have_them() -> None:
    p, _ = sk.forward_kinematics(REST, sk.STANDARD_OFFSETS[Joint.HIPS])
    assert (p[Joint.HEAD] + sk.EYES)[1] / sk.STATURE == pytest.approx(0.936, abs=2e-3)
    assert 1.0 / sk.STATURE == pytest.approx(0.586, abs=1e-3)


def test_bone_lengths_do_not_depend_on_the_pose() -> None:
    p, _ = sk.forward_kinematics(R_LOCAL, P_HIPS)
    bones = np.linalg.norm(p[:, 1:] - p[:, list(sk.PARENTS[1:])], axis=-1)
    assert np.allclose(bones, np.linalg.norm(sk.STANDARD_OFFSETS[1:], axis=-1), atol=1e-12)


def test_a_batch_is_the_same_as_one_by_one() -> None:
    p, R = sk.forward_kinematics(R_LOCAL, P_HIPS)
    for i in range(5):
        p_i, R_i = sk.forward_kinematics(R_LOCAL[i], P_HIPS[i])
        assert np.allclose(p[i], p_i)
        assert np.allclose(R[i], R_i)


def test_local_and_world_rotations_are_inverse() -> None:
    assert np.allclose(sk.local_rotations(sk.global_rotations(R_LOCAL)), R_LOCAL)


def test_mirroring_twice_changes_nothing() -> None:
    assert np.array_equal(sk.mirror_rotations(sk.mirror_rotations(R_LOCAL)), R_LOCAL)
    assert [sk.MIRRORED[sk.MIRRORED[j]] for j in Joint] == list(Joint)


def test_mirroring_the_rotations_mirrors_the_figure() -> None:
    p, _ = sk.forward_kinematics(R_LOCAL, P_HIPS)
    mirrored, _ = sk.forward_kinematics(sk.mirror_rotations(R_LOCAL), P_HIPS * [-1, 1, 1])
    assert np.allclose(mirrored, sk.mirror_points(p))


def test_a_body_scaled_to_standard_has_its_hips_at_one_metre() -> None:
    body = Body.standard(2, hips_height_m=0.87)
    scaled = body.scaled_to_standard()
    assert np.allclose(scaled.offsets, sk.STANDARD_OFFSETS)
    assert np.allclose(body.scale * 0.87, 1.0)
