"""Laws of the legs' Jacobian IK (Yang et al. 2021, section 3.4.1)."""

import numpy as np
import pytest

from lobstr_hw.ik.jacobian import LegBones, LegPose, solve_legs
from lobstr_hw.ik.vectors import rotate, unit
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle, rotation_x
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

REACH = sum(np.linalg.norm(STANDARD_OFFSETS[j]) for j in (15, 16, 17))


def legs(rng: np.random.Generator, n: int) -> tuple[LegPose, Array, LegBones]:
    """Random legs with bent knees, their hip joints, and the standard bones."""
    upper = from_rotation_vector(rng.normal(scale=0.3, size=(n, 2, 3)))
    lower = upper @ rotation_x(np.abs(rng.normal(scale=0.5, size=(n, 2))))
    foot = lower @ from_rotation_vector(rng.normal(scale=0.2, size=(n, 2, 3)))
    p_hip = np.array([[0.09, 0.9, 0.0], [-0.09, 0.9, 0.0]]) + rng.normal(scale=0.1, size=(n, 2, 3))
    bones = LegBones(
        *(
            np.broadcast_to(STANDARD_OFFSETS[[left, right]], (n, 2, 3))
            for left, right in ((15, 19), (16, 20), (17, 21))
        )
    )
    return LegPose(upper, lower, foot), p_hip, bones


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def test_the_toe_base_meets_every_target_in_reach(rng: np.random.Generator) -> None:
    pose, p_hip, bones = legs(rng, 500)
    target = pose.toe(p_hip, bones) + rng.normal(scale=0.08, size=(500, 2, 3))
    far = np.linalg.norm(target - p_hip, axis=-1) > 0.98 * REACH
    error = np.linalg.norm(
        solve_legs(pose, p_hip, bones, target).toe(p_hip, bones) - target, axis=-1
    )
    assert error[~far].max() < 1e-4
    assert 0.0 < far.mean() < 0.5


def test_a_toe_that_is_there_already_leaves_the_pose_alone(rng: np.random.Generator) -> None:
    pose, p_hip, bones = legs(rng, 200)
    same = solve_legs(pose, p_hip, bones, pose.toe(p_hip, bones))
    for before, after in (
        (pose.upper, same.upper),
        (pose.lower, same.lower),
        (pose.foot, same.foot),
    ):
        np.testing.assert_allclose(after, before, atol=1e-6)


def test_the_foot_keeps_its_rotation_where_the_ankle_can_follow(rng: np.random.Generator) -> None:
    pose, p_hip, bones = legs(rng, 300)
    target = pose.toe(p_hip, bones) + rng.normal(scale=0.05, size=(300, 2, 3))
    ankle = target - rotate(pose.foot, bones.foot)
    can = np.linalg.norm(ankle - p_hip, axis=-1) < 0.999 * 0.84
    turned = geodesic_angle(solve_legs(pose, p_hip, bones, target).foot, pose.foot)
    assert turned[can].max() < 1e-9
    assert turned[~can].max() > 0.01, "stretched legs lift the heel"


def test_the_knee_stays_a_hinge(rng: np.random.Generator) -> None:
    pose, p_hip, bones = legs(rng, 300)
    target = pose.toe(p_hip, bones) + rng.normal(scale=0.1, size=(300, 2, 3))
    out = solve_legs(pose, p_hip, bones, target)
    knee = np.swapaxes(out.upper, -1, -2) @ out.lower
    np.testing.assert_allclose(
        knee[..., :, 0], np.broadcast_to([1.0, 0.0, 0.0], (300, 2, 3)), atol=1e-9
    )


def test_out_of_reach_the_leg_points_at_the_target_and_keeps_its_length(
    rng: np.random.Generator,
) -> None:
    pose, p_hip, bones = legs(rng, 100)
    way = unit(pose.toe(p_hip, bones) - p_hip)
    out = solve_legs(pose, p_hip, bones, p_hip + 1.2 * way)
    toe = out.toe(p_hip, bones) - p_hip
    assert np.linalg.norm(toe, axis=-1).max() < REACH + 1e-9
    assert np.sum(unit(toe) * way, axis=-1).min() > 0.98


def test_a_batch_gives_what_its_members_give_alone(rng: np.random.Generator) -> None:
    pose, p_hip, bones = legs(rng, 40)
    target = pose.toe(p_hip, bones) + rng.normal(scale=0.15, size=(40, 2, 3))
    together = solve_legs(pose, p_hip, bones, target)
    for i in range(40):
        one = slice(i, i + 1)
        alone = solve_legs(
            LegPose(pose.upper[one], pose.lower[one], pose.foot[one]),
            p_hip[one],
            LegBones(bones.upper[one], bones.lower[one], bones.foot[one]),
            target[one],
        )
        np.testing.assert_allclose(alone.upper, together.upper[one], atol=1e-12)
        np.testing.assert_allclose(alone.lower, together.lower[one], atol=1e-12)
        np.testing.assert_allclose(alone.foot, together.foot[one], atol=1e-12)


def test_small_steps_of_the_target_are_small_steps_of_the_leg(rng: np.random.Generator) -> None:
    pose, p_hip, bones = legs(rng, 2000)
    target = pose.toe(p_hip, bones) + rng.normal(scale=0.06, size=(2000, 2, 3))
    near = np.linalg.norm(target - p_hip, axis=-1) < 0.9 * REACH
    moved = target + 1e-4 * unit(rng.normal(size=target.shape))
    before, after = (solve_legs(pose, p_hip, bones, t) for t in (target, moved))
    steps = [
        geodesic_angle(getattr(before, k), getattr(after, k)) for k in ("upper", "lower", "foot")
    ]
    # a straight knee bends with the square root of what is missing: the bound cannot be tighter
    assert np.max(steps, axis=0)[near].max() < 0.05


def test_joint_numbers_are_those_of_the_skeleton() -> None:
    assert (Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT, Joint.LEFT_TOES) == (15, 16, 17)
