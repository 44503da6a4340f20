"""Laws of simulated takes."""

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.motion import Motion
from lobstr_hw.rotations import geodesic_angle, transpose
from lobstr_hw.simulation import Sway, TrackingErrors, drawn_user, simulate, take_samples
from lobstr_hw.skeleton import PARENTS, Joint
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT

JOINTS = [ROLE_JOINT[role] for role in FOUR_POINTS]
PERFECT = TrackingErrors.none()


@pytest.fixture(scope="module")
def walk() -> Motion:
    return walking(4.0)


def test_the_same_seed_gives_the_same_take(walk: Motion) -> None:
    a, b = simulate(walk, 5), simulate(walk, 5)
    np.testing.assert_array_equal(a.p, b.p)
    np.testing.assert_array_equal(a.R, b.R)
    np.testing.assert_array_equal(a.tracked, b.tracked)
    assert a.serials == b.serials


def test_another_seed_gives_another_person(walk: Motion) -> None:
    a, b = simulate(walk, 5), simulate(walk, 6)
    assert a.user.stature_m != b.user.stature_m
    assert set(a.serials.values()).isdisjoint(b.serials.values())


@pytest.mark.parametrize("seed", range(5))
def test_the_mounts_take_true_joints_to_trackers(walk: Motion, seed: int) -> None:
    take = simulate(walk, seed, errors=PERFECT)
    every_other = take.p[::2], take.R[::2]  # 90 Hz samples at the truth's 45 Hz
    for k, role in enumerate(FOUR_POINTS):
        mount = take.user.mounts[role]
        R, p = take.truth_R[:, JOINTS[k]], take.truth_p[:, JOINTS[k]]
        np.testing.assert_allclose(every_other[1][:, k], R @ mount.R, atol=1e-9)
        np.testing.assert_allclose(every_other[0][:, k], p + R @ mount.p, atol=1e-9)


def test_bones_keep_the_lengths_of_the_body(walk: Motion) -> None:
    take = simulate(walk, 3)
    bones = np.linalg.norm(take.truth_p[:, 1:] - take.truth_p[:, PARENTS[1:]], axis=-1)
    expected = np.linalg.norm(take.user.body.offsets[0, 1:], axis=-1)
    np.testing.assert_allclose(bones, np.broadcast_to(expected, bones.shape), atol=1e-9)


def test_other_mounts_leave_the_person_and_the_motion_alone(walk: Motion) -> None:
    a, b = simulate(walk, 3), simulate(walk, 3, mount_seed=99)
    np.testing.assert_array_equal(a.user.body.offsets, b.user.body.offsets)
    home = [t.user.T_tracking_play.inverse() for t in (a, b)]
    np.testing.assert_allclose(home[0].apply(a.truth_p), home[1].apply(b.truth_p), atol=1e-9)
    assert np.max(np.abs(a.p - b.p)) > 0.1


@pytest.mark.parametrize("height_cm", [150.0, 171.0, 195.0])
def test_the_eyes_stand_at_their_share_of_the_height_asked_for(
    walk: Motion, height_cm: float
) -> None:
    take = simulate(walk, 1, height_cm, errors=PERFECT, pose_deviation_deg=0.0, sway=Sway.none())
    eyes_over_head = 0.062 * height_cm / 170.6
    eyes_m = take.truth_p[0, Joint.HEAD, 1] + eyes_over_head
    assert eyes_m == pytest.approx(0.936 * height_cm / 100.0, abs=1e-9)


def test_an_ideal_t_pose_has_every_joint_parallel_to_the_play_space(walk: Motion) -> None:
    take = simulate(walk, 1, errors=PERFECT, pose_deviation_deg=0.0, sway=Sway.none())
    held = take.truth_times_s <= take.t_pose_s[1]
    off = geodesic_angle(take.truth_R[held], take.user.T_tracking_play.R)
    assert np.max(off) < 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_segments_stand_off_the_t_pose_by_ten_degrees_at_most(walk: Motion, seed: int) -> None:
    take = simulate(walk, seed, errors=PERFECT, sway=Sway.none())
    R = transpose(take.user.T_tracking_play.R) @ take.truth_R[0, JOINTS]
    off = np.rad2deg(geodesic_angle(R, np.eye(3)))
    assert np.all(off <= 10.0)
    assert np.max(off) > 0.5


def test_feet_stay_put_in_the_t_pose(walk: Motion) -> None:
    take = simulate(walk, 2)
    held = take.truth_times_s <= take.t_pose_s[1]
    feet = take.truth_p[held][:, [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]]
    assert np.max(np.ptp(feet, axis=0)) < 1e-6


def test_the_way_from_t_pose_to_motion_is_smooth_and_above_the_floor(walk: Motion) -> None:
    take = simulate(walk, 4)
    way = take.truth_times_s < take.t_pose_s[1] + 2.5
    p = take.truth_p[way]
    acceleration = np.linalg.norm(np.diff(p, 2, axis=0), axis=-1) * 45.0**2
    assert np.max(acceleration) < 40.0
    assert np.min(p[:, [Joint.LEFT_TOES, Joint.RIGHT_TOES], 1]) > 0.01
    turns = geodesic_angle(take.truth_R[way][1:], take.truth_R[way][:-1])
    assert np.rad2deg(np.max(turns)) < 15.0


def test_samples_come_oldest_first_with_what_the_take_says(walk: Motion) -> None:
    take = simulate(walk, 7)
    samples = list(take_samples(take))
    times = [s.time_s for s in samples]
    assert times == sorted(times)
    assert len(samples) == take.tracked.size
    assert [s.tracked for s in samples] == take.tracked.ravel().tolist()
    position = samples[-1].T_world_tracker.p
    assert position is not None
    np.testing.assert_array_equal(position, take.p[-1, -1])


def test_someone_made_elsewhere_can_wear_the_trackers(walk: Motion) -> None:
    user = drawn_user(1, 180.0, heading_rad=0.5, origin=np.zeros(3))
    take = simulate(walk, 2, user=user)
    assert take.user is user
    assert take.serials == user.serials
