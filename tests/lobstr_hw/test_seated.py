"""Sitting legs and blended poses: bones keep their lengths, feet the floor."""

from dataclasses import replace

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.blend import blend
from lobstr_hw.floor import FootShape
from lobstr_hw.ik.vectors import rotate
from lobstr_hw.rotations import Array, geodesic_angle, rotation_y
from lobstr_hw.seated import STAY_M, Seat, sit
from lobstr_hw.skeleton import PARENTS, Body, Joint, forward_kinematics, global_rotations
from lobstr_hw.skeleton_pose import Mode, SkeletonPose, Source

FEET, TOES = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT], [Joint.LEFT_TOES, Joint.RIGHT_TOES]
LEGS = range(Joint.LEFT_UPPER_LEG, Joint.RIGHT_TOES + 1)


def posed(R_local: Array, p_hips: Array, body: Body, time_s: float = 0.0) -> SkeletonPose:
    p, _ = forward_kinematics(R_local, p_hips, body.offsets)
    feet = np.zeros((len(p_hips), 2), dtype=bool)
    source = np.full((len(p_hips), 22), Source.PREDICTED, dtype=np.int8)
    return SkeletonPose(time_s, p, R_local, feet, feet, source, {})


def hips_at(height_m: float, body: Body, x: float = 0.0, yaw: float = 0.0) -> SkeletonPose:
    R = np.tile(np.eye(3), (1, 22, 1, 1))
    R[0, 0] = rotation_y(yaw)
    return posed(R, np.array([[x, height_m, 0.0]]), body)


def steps(n: int = 40) -> tuple[Body, list[SkeletonPose]]:
    """Frames of somebody who walks."""
    motion = walking(2.0)
    body = Body.standard(1)
    return body, [
        posed(motion.R_local[None, k], motion.p_hips[None, k], body) for k in range(0, n, 4)
    ]


def assert_whole(pose: SkeletonPose, body: Body) -> None:
    """Bones as long as the body's, no foot under the floor, rotations that are ones."""
    bones = np.linalg.norm(pose.p_world[:, 1:] - pose.p_world[:, PARENTS[1:]], axis=-1)
    np.testing.assert_allclose(bones, np.linalg.norm(body.offsets[:, 1:], axis=-1), atol=1e-9)
    R = global_rotations(pose.R_local)
    shape, toe = FootShape.of(body), pose.p_world[:, TOES]
    assert (toe[..., 1] >= shape.ball_m - 1e-6).all()
    assert ((toe + rotate(R[:, FEET], shape.heel))[..., 1] >= -1e-6).all()
    assert ((toe + rotate(R[:, TOES], shape.tip))[..., 1] >= shape.tip_m - 1e-6).all()


@pytest.mark.parametrize("size", [0.9, 1.15])
@pytest.mark.parametrize("share", [0.42, 0.5, 0.65, 0.9])
@pytest.mark.parametrize("yaw", [0.0, 2.5])
def test_on_any_seat_the_feet_stand_flat_in_front_of_it(
    size: float, share: float, yaw: float
) -> None:
    body = Body.standard(1, size)
    pose = hips_at(share * size, body, yaw=yaw)
    _, seated = sit(pose, body, None, 0.0)
    assert_whole(seated, body)
    np.testing.assert_allclose(seated.p_world[:, TOES, 1], body.sole[0], atol=1e-6)
    ahead = (seated.p_world[:, TOES] - pose.p_world[:, [0]]) @ rotation_y(yaw)[:, 2]
    assert (ahead > 0.05).all()
    knee = (seated.p_world[:, [Joint.LEFT_LOWER_LEG]] - pose.p_world[:, [0]]) @ rotation_y(yaw)
    assert (knee[..., 2] > 0.0).all(), "knees bend forward"


def test_the_upper_body_and_the_hips_are_left_alone() -> None:
    body, poses = steps()
    for pose in poses:
        _, seated = sit(pose, body, None, 0.0)
        others = [j for j in range(22) if j not in LEGS]
        np.testing.assert_allclose(seated.p_world[:, others], pose.p_world[:, others], atol=1e-9)
        assert (geodesic_angle(seated.R_local, pose.R_local)[:, others] < 1e-6).all()
        assert seated.mode is Mode.SEATED


def test_feet_stay_while_the_seat_moves_little_and_follow_when_it_goes() -> None:
    body = Body.standard(1)
    seat, first = sit(hips_at(0.5, body), body, None, 0.0)
    for x in np.linspace(0.0, 0.9 * STAY_M, 20):
        seat, pose = sit(hips_at(0.5, body, x), body, seat, 0.02)
        np.testing.assert_allclose(pose.p_world[:, FEET], first.p_world[:, FEET], atol=1e-6)
    for _ in range(200):
        seat, pose = sit(hips_at(0.5, body, 1.0), body, seat, 0.02)
        assert_whole(pose, body)
    moved = pose.p_world[:, FEET, 0] - first.p_world[:, FEET, 0]
    np.testing.assert_allclose(moved, 1.0, atol=0.02)


def test_feet_do_not_jump_when_a_chair_is_turned() -> None:
    body = Body.standard(1)
    seat: Seat | None = None
    before: Array | None = None
    for k in range(200):
        seat, pose = sit(hips_at(0.5, body, yaw=min(0.02 * k, 2.0)), body, seat, 0.02)
        ankle = pose.p_world[:, FEET]
        if before is not None:
            assert np.linalg.norm(ankle - before, axis=-1).max() < 0.06
        before = ankle
        assert_whole(pose, body)


def test_a_blend_begins_and_ends_at_its_poses_and_is_whole_in_between() -> None:
    body, poses = steps()
    old, new = sit(hips_at(0.5, body), body, None, 0.0)[1], poses[3]
    np.testing.assert_allclose(blend(old, new, 0.0, body).p_world, old.p_world, atol=1e-9)
    assert blend(old, new, 1.0, body) is new
    for share in np.linspace(0.0, 1.0, 11):
        assert_whole(blend(old, new, float(share), body), body)


def test_what_is_no_pose_comes_from_the_new_one() -> None:
    body, poses = steps()
    new = replace(poses[1], time_s=7.0, mode=Mode.LYING)
    half = blend(poses[0], new, 0.5, body)
    assert (half.time_s, half.mode) == (7.0, Mode.LYING)
