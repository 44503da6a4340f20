"""Laws of calibrating from a T-pose."""

import numpy as np
import pytest
from support.calibrations import calibrated, expected_user, found_t_pose
from support.motions import walking

from lobstr_hw.calibration import Calibration, TPose, calibrate_t_pose
from lobstr_hw.motion import Motion
from lobstr_hw.predictors.predictor import Frame
from lobstr_hw.rotations import Array, geodesic_angle, rotation_y, transpose
from lobstr_hw.simulation import SimulatedTake, Sway, TrackingErrors, simulate
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT

JOINTS = [ROLE_JOINT[role] for role in FOUR_POINTS]
PERFECT = TrackingErrors.none()


@pytest.fixture(scope="module")
def walk() -> Motion:
    return walking(2.0)


def ideal(motion: Motion, seed: int, mount_seed: int | None = None) -> SimulatedTake:
    """No tracking errors, and a statue in a perfect T-pose."""
    return simulate(
        motion,
        seed,
        mount_seed=mount_seed,
        errors=PERFECT,
        sway=Sway.none(),
        pose_deviation_deg=0.0,
    )


def moved(pose: TPose, yaw: float, p: Array) -> TPose:
    """The same person seen from a play space that was turned and shifted."""
    R = rotation_y(yaw)
    return TPose(
        pose.serials,
        pose.p @ R.T + p,
        R @ pose.R,
        pose.start_s,
        pose.end_s,
        pose.spread_m,
        pose.spread_rad,
        pose.quality,
    )


def frame_of(calibration: Calibration, p: Array, R: Array) -> Frame:
    valid = np.ones(p.shape[:2], dtype=bool)
    return calibration.frame(0.0, FOUR_POINTS, p, R, valid, valid)


@pytest.mark.parametrize("stature_m", [1.5, 1.7, 1.95])
@pytest.mark.parametrize("seed", range(4))
def test_who_is_as_expected_is_measured_exactly(walk: Motion, seed: int, stature_m: float) -> None:
    rng = np.random.default_rng(seed)
    user = expected_user(rng, stature_m, rng.uniform(-3.0, 3.0), rng.normal(size=3) * [1, 0, 1])
    take = simulate(walk, seed, user=user, errors=PERFECT, sway=Sway.none(), pose_deviation_deg=0.0)
    calibration = calibrated(take)
    for serial, role in calibration.roles.items():
        true, found = user.mounts[role].inverse(), calibration.T_tracker_joint(serial)
        assert np.max(np.abs(found.R - true.R)) < 1e-6
        assert np.max(np.abs(found.p - true.p)) < 1e-6
    np.testing.assert_allclose(calibration.body.offsets, user.body.offsets, atol=1e-6)
    assert calibration.stature_m == pytest.approx(stature_m, abs=1e-6)
    heading = rotation_y(calibration.heading_rad)
    assert np.max(geodesic_angle(heading, user.T_tracking_play.R)) < 1e-6


@pytest.mark.parametrize("seed", range(8))
def test_in_an_ideal_t_pose_hands_and_pelvis_are_off_by_the_heading_only(
    walk: Motion, seed: int
) -> None:
    take = ideal(walk, seed)
    calibration = calibrated(take)
    off = rotation_y(calibration.heading_rad).T @ take.user.T_tracking_play.R
    for i, role in list(enumerate(FOUR_POINTS))[1:]:
        found = calibration.R_tracker_joint[i]
        np.testing.assert_allclose(found.T, off @ take.user.mounts[role].R, atol=1e-6)
    assert np.rad2deg(np.max(geodesic_angle(off, np.eye(3)))) < 8.0


@pytest.mark.parametrize("seed", range(6))
def test_turning_and_shifting_the_play_space_changes_the_heading_only(
    walk: Motion, seed: int
) -> None:
    pose = found_t_pose(simulate(walk, seed))
    a = calibrate_t_pose(pose)
    b = calibrate_t_pose(moved(pose, 1.9, np.array([3.0, 0.0, -2.0])))
    np.testing.assert_allclose(a.body.offsets, b.body.offsets, atol=1e-9)
    np.testing.assert_allclose(a.R_tracker_joint, b.R_tracker_joint, atol=1e-9)
    np.testing.assert_allclose(a.p_tracker_joint, b.p_tracker_joint, atol=1e-9)
    turned = np.angle(np.exp(1j * (b.heading_rad - a.heading_rad - 1.9)))
    assert turned == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_how_hands_and_pelvis_trackers_are_turned_does_not_matter(walk: Motion, seed: int) -> None:
    pose = found_t_pose(simulate(walk, seed))
    turn = np.stack([np.eye(3), rotation_y(1.0), rotation_y(-2.0), rotation_y(0.7)])
    other = TPose(
        pose.serials,
        pose.p,
        pose.R @ turn,
        pose.start_s,
        pose.end_s,
        pose.spread_m,
        pose.spread_rad,
        pose.quality,
    )
    a, b = calibrate_t_pose(pose), calibrate_t_pose(other)
    np.testing.assert_array_equal(a.body.offsets, b.body.offsets)
    frames = [frame_of(c, t.p[None], t.R[None]) for c, t in ((a, pose), (b, other))]
    np.testing.assert_allclose(frames[0].p, frames[1].p, atol=1e-12)
    np.testing.assert_allclose(frames[0].R, frames[1].R, atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_joints_of_the_t_pose_are_those_of_the_measured_body_held_straight(
    walk: Motion, seed: int
) -> None:
    pose = found_t_pose(simulate(walk, seed))
    calibration = calibrate_t_pose(pose)
    frame = frame_of(calibration, pose.p[None], pose.R[None])
    R = transpose(rotation_y(calibration.heading_rad)) @ frame.R[0]
    np.testing.assert_allclose(R[1:], np.broadcast_to(np.eye(3), (3, 3, 3)), atol=1e-9)
    assert frame.p[0, 3, 1] == pytest.approx(1.0, abs=0.02)  # hips, on the standard skeleton
    # the head over the hips by the trunk, the hands apart by arms and shoulders
    wrists = np.linalg.norm(frame.p[0, 1] - frame.p[0, 2]) / calibration.scale
    reach = 2.0 * (calibration.arm_m + calibration.body.offsets[0, 6:8, 0].sum())
    assert wrists == pytest.approx(reach, rel=0.05)


@pytest.mark.parametrize("seed", range(10))
def test_measures_of_a_sloppy_t_pose_are_within_a_few_deviations(walk: Motion, seed: int) -> None:
    take = simulate(walk, seed)
    calibration = calibrated(take)
    residuals = calibration.residuals
    hips_off_m = 1.0 / calibration.scale - 1.0 / take.user.body.scale[0]
    assert abs(hips_off_m) < 3.5 * residuals.hips_height_deviation_m
    for i, role in enumerate(FOUR_POINTS):
        off = geodesic_angle(calibration.R_tracker_joint[i].T, take.user.mounts[role].R)
        assert np.rad2deg(np.max(off)) < 20.0


def test_a_stature_that_is_given_overrules_the_headset(walk: Motion) -> None:
    take = simulate(walk, 3, 170.0)
    assert calibrated(take, stature_m=1.85).stature_m == pytest.approx(1.85, abs=0.002)


def test_a_stature_that_fits_nobody_shows_in_the_misfit(walk: Motion) -> None:
    take = simulate(walk, 3, 170.0)
    assert calibrated(take).residuals.misfit < 1.5
    assert calibrated(take, stature_m=1.95).residuals.misfit > 2.0


def test_the_right_stature_makes_the_hips_height_no_less_certain(walk: Motion) -> None:
    take = simulate(walk, 3, 170.0)
    guessed, known = calibrated(take), calibrated(take, stature_m=1.70)
    assert known.residuals.hips_height_deviation_m <= guessed.residuals.hips_height_deviation_m


def test_calibrating_twice_is_calibrating_once(walk: Motion) -> None:
    take = simulate(walk, 4)
    pose = found_t_pose(take)
    a, b = calibrate_t_pose(pose), calibrate_t_pose(found_t_pose(take))
    np.testing.assert_array_equal(a.R_tracker_joint, b.R_tracker_joint)
    np.testing.assert_array_equal(a.p_tracker_joint, b.p_tracker_joint)
    np.testing.assert_array_equal(a.body.offsets, b.body.offsets)


def test_a_floor_that_lies_elsewhere_changes_no_measure(walk: Motion) -> None:
    pose = found_t_pose(simulate(walk, 5))
    a = calibrate_t_pose(pose)
    raised = moved(pose, 0.0, np.array([0.0, 0.3, 0.0]))
    b = calibrate_t_pose(raised, floor_m=0.3)
    np.testing.assert_allclose(a.body.offsets, b.body.offsets, atol=1e-9)
    frames = [frame_of(c, t.p[None], t.R[None]) for c, t in ((a, pose), (b, raised))]
    np.testing.assert_allclose(frames[0].p, frames[1].p, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_other_mounts_give_the_same_hands_and_pelvis_up_to_the_heading(
    walk: Motion, seed: int
) -> None:
    takes = [ideal(walk, seed, mount_seed) for mount_seed in (seed, seed + 100)]
    calibrations = [calibrated(take) for take in takes]
    R = [
        take.user.T_tracking_play.R.T @ frame_of(calibration, take.p, take.R).R
        for take, calibration in zip(takes, calibrations, strict=True)
    ]
    # each joint is turned about its own Y by the error of the heading, so Y itself agrees
    np.testing.assert_allclose(R[0][:, 1:, :, 1], R[1][:, 1:, :, 1], atol=1e-6)
    off = [
        take.user.T_tracking_play.R.T @ rotation_y(calibration.heading_rad)
        for take, calibration in zip(takes, calibrations, strict=True)
    ]
    np.testing.assert_allclose(R[0][:, 1:] @ off[0].T, R[1][:, 1:] @ off[1].T, atol=1e-6)
