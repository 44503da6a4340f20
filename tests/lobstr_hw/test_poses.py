"""Poses form a group, are checked once and cannot be written to."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lobstr_hw.poses import PartialPose, Pose

RNG = np.random.default_rng(1)


def random_poses(seed: int, n: int = 20) -> Pose:
    return Pose(Rotation.random(n, random_state=seed).as_matrix(), RNG.normal(size=(n, 3)))


def same(a: Pose, b: Pose) -> bool:
    return np.allclose(a.R, b.R) and np.allclose(a.p, b.p)


def test_a_pose_times_its_inverse_is_the_identity() -> None:
    T = random_poses(1)
    assert same(T @ T.inverse(), Pose.identity())
    assert same(T.inverse() @ T, Pose.identity())


def test_chaining_is_associative() -> None:
    A, B, C = random_poses(1), random_poses(2), random_poses(3)
    assert same((A @ B) @ C, A @ (B @ C))


def test_chaining_applies_the_right_one_first() -> None:
    A, B, x = random_poses(1), random_poses(2), RNG.normal(size=(20, 3))
    assert np.allclose((A @ B).apply(x), A.apply(B.apply(x)))


def test_a_pose_is_a_copy_that_cannot_be_written_to() -> None:
    p = np.zeros(3)
    T = Pose(np.eye(3), p)
    p[0] = 1.0
    assert T.p[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        T.p[0] = 1.0


def test_a_wrong_shape_is_told_at_once() -> None:
    with pytest.raises(ValueError, match=r"expected \(..., 3, 3\), got \(4, 4\)"):
        Pose(np.eye(4), np.zeros(3))


def test_a_partial_pose_may_lack_its_position() -> None:
    assert PartialPose(np.eye(3), None).p is None
