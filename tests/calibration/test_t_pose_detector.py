"""The detector finds T-poses, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from support.calibrations import found_t_pose
from support.motions import arms_down, walking

from lobstr_hw.calibration import TPoseDetector
from lobstr_hw.errors import MissingRole, TPoseNotFound
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import rotation_x
from lobstr_hw.simulation import SimulatedTake, TrackingErrors, simulate, take_samples
from lobstr_hw.skeleton import Joint
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample


def hints(take: SimulatedTake) -> dict[str, TrackerRole]:
    return {serial: role for role, serial in take.serials.items()}


def samples_without(take: SimulatedTake, role: TrackerRole) -> list[TrackerSample]:
    return [s for s in take_samples(take) if s.serial != take.serials[role]]


@pytest.mark.parametrize("hinted", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_ten_degrees_of_deviation_are_accepted_and_roles_are_right(seed: int, hinted: bool) -> None:
    take = simulate(walking(1.0), seed)
    pose = found_t_pose(take, hinted=hinted)
    assert pose.serials == tuple(take.serials[role] for role in FOUR_POINTS)
    assert pose.end_s <= take.t_pose_s[1] + 0.4


@pytest.mark.parametrize("seed", range(5))
def test_walking_is_no_t_pose(seed: int) -> None:
    take = simulate(walking(8.0, seed=seed), seed, t_pose_s=0.0)
    detector = TPoseDetector(hints(take))
    assert detector.add(take_samples(take)) is None
    assert isinstance(detector.failure(), TPoseNotFound)


@pytest.mark.parametrize("hinted", [True, False])
def test_standing_with_hanging_arms_is_no_t_pose(hinted: bool) -> None:
    take = simulate(arms_down(4.0), 1, t_pose_s=0.0)
    detector = TPoseDetector(hints(take) if hinted else None)
    assert detector.add(take_samples(take)) is None
    assert "stretch both arms" in str(detector.failure())


@pytest.mark.parametrize("pitch_deg", [-80.0, 60.0])
def test_arms_held_forward_or_up_are_no_t_pose(pitch_deg: float) -> None:
    motion = arms_down(4.0)
    R = np.array(motion.R_local)
    R[:, [Joint.LEFT_UPPER_ARM, Joint.RIGHT_UPPER_ARM]] = (
        rotation_x(np.deg2rad(pitch_deg)) @ R[:, [Joint.LEFT_UPPER_ARM, Joint.RIGHT_UPPER_ARM]]
    )
    take = simulate(replace(motion, R_local=R), 2, t_pose_s=0.0)
    detector = TPoseDetector(hints(take))
    assert detector.add(take_samples(take)) is None


def test_a_t_pose_that_is_too_short_is_not_taken() -> None:
    take = simulate(walking(4.0), 1, t_pose_s=0.5)
    detector = TPoseDetector(hints(take))
    assert detector.add(take_samples(take)) is None


def test_a_t_pose_in_the_middle_of_a_stream_is_found() -> None:
    take = simulate(walking(4.0), 3)
    samples = list(take_samples(take))
    end_s = samples[-1].time_s
    backwards = [replace(s, time_s=end_s - s.time_s) for s in reversed(samples)]
    pose = TPoseDetector(hints(take)).add(backwards)
    assert pose is not None
    assert pose.start_s > 4.0


def test_seeing_the_stream_in_one_piece_or_in_many_is_the_same() -> None:
    take = simulate(walking(1.0), 6)
    samples = list(take_samples(take))
    whole = TPoseDetector(hints(take)).add(samples)
    detector = TPoseDetector(hints(take))
    parts = [detector.add(samples[i : i + 37]) for i in range(0, 800, 37)]
    first = next(part for part in parts if part is not None)
    assert whole is not None
    np.testing.assert_array_equal(whole.p, first.p)
    assert whole.end_s == first.end_s


def test_exchanged_controllers_are_told() -> None:
    take = simulate(walking(1.0), 2)
    swapped = hints(take)
    left, right = take.serials[TrackerRole.LEFT_HAND], take.serials[TrackerRole.RIGHT_HAND]
    swapped[left], swapped[right] = swapped[right], swapped[left]
    detector = TPoseDetector(swapped)
    assert detector.add(take_samples(take)) is None
    assert "left and right are exchanged" in str(detector.failure())


@pytest.mark.parametrize("hinted", [True, False])
def test_a_missing_pelvis_is_told_with_what_was_seen(hinted: bool) -> None:
    take = simulate(walking(1.0), 2)
    detector = TPoseDetector(hints(take) if hinted else None)
    assert detector.add(samples_without(take, TrackerRole.PELVIS)) is None
    error = detector.failure()
    assert isinstance(error, MissingRole)
    assert take.serials[TrackerRole.HEAD] in str(error)
    assert "pelvis" in str(error)


def test_a_foot_tracker_does_not_stand_in_for_the_pelvis() -> None:
    take = simulate(walking(1.0), 2)
    claimed = hints(take)
    claimed[take.serials[TrackerRole.PELVIS]] = TrackerRole.LEFT_FOOT
    detector = TPoseDetector(claimed)
    assert detector.add(take_samples(take)) is None
    assert isinstance(detector.failure(), MissingRole)


def test_lost_sight_broken_numbers_and_missing_positions_do_not_hurt() -> None:
    take = simulate(walking(1.0), 8, errors=TrackingErrors.none())
    clean = found_t_pose(take)
    spoiled = []
    for i, sample in enumerate(take_samples(take)):
        pose = sample.T_world_tracker
        assert pose.p is not None
        if i % 11 == 3:
            sample = replace(sample, T_world_tracker=PartialPose(pose.R, pose.p * np.nan))
        elif i % 11 == 5:
            sample = replace(sample, T_world_tracker=PartialPose(pose.R, None))
        elif i % 11 == 7:
            far = PartialPose(pose.R, pose.p + 5.0)
            sample = replace(sample, T_world_tracker=far, tracked=False)
        spoiled.append(sample)
    found = TPoseDetector(hints(take)).add(spoiled)
    assert found is not None
    np.testing.assert_allclose(found.p, clean.p, atol=2e-3)


def test_before_anything_is_seen_all_roles_are_missing() -> None:
    error = TPoseDetector().failure()
    assert isinstance(error, MissingRole)
    assert "no tracker at all" in str(error)
