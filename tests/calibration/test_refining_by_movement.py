"""Laws of calibrating from a T-pose and movement."""

import numpy as np
import pytest
from support.movers import ideal_take, pose_and_recording, refined, somebodys_take

from lobstr_hw.calibration import Calibration, Movement, TPose, calibrate_t_pose, refine_by_movement
from lobstr_hw.rotations import Array, geodesic_angle, rotation_y
from lobstr_hw.simulation import SimulatedTake
from lobstr_hw.trackers import FOUR_POINTS

SEEDS = range(6)


def turns(take: SimulatedTake, found: Calibration) -> Array:
    """Angles (4) of the found joint frames to the true ones, degrees."""
    mounts = np.stack([take.user.mounts[role].R for role in FOUR_POINTS])
    return np.asarray(np.rad2deg(geodesic_angle(mounts @ found.R_tracker_joint, np.eye(3))))


def levers(take: SimulatedTake, found: Calibration) -> Array:
    """Distances (4) of the found joints from the true ones, metres."""
    true = np.stack([take.user.mounts[role].inverse().p for role in FOUR_POINTS])
    return np.asarray(np.linalg.norm(found.p_tracker_joint - true, axis=-1))


def nobody_moves(pose: TPose) -> Movement:
    n = 5
    return Movement(
        np.arange(n) / 45.0,
        np.broadcast_to(pose.p, (n, 4, 3)),
        np.broadcast_to(pose.R, (n, 4, 3, 3)),
        np.ones((n, 4), dtype=bool),
    )


@pytest.mark.parametrize("seed", [1, 2])
def test_without_movement_the_t_pose_stands_and_everything_is_said_to_be_missing(seed: int) -> None:
    pose, _ = pose_and_recording(somebodys_take(seed))
    result = refine_by_movement(pose, nobody_moves(pose))
    alone = calibrate_t_pose(pose)
    apart = geodesic_angle(result.calibration.R_tracker_joint, alone.R_tracker_joint)
    assert np.rad2deg(np.max(apart)) < 0.5
    np.testing.assert_allclose(
        result.calibration.p_tracker_joint, alone.p_tracker_joint, atol=0.004
    )
    for quantity in result.quantities:
        assert quantity.after == pytest.approx(quantity.before)
        assert quantity.name == "hips height" or not quantity.refined


def test_who_moves_as_the_anatomist_has_it_is_measured_whatever_the_t_pose_was() -> None:
    takes = [ideal_take(seed) for seed in SEEDS]
    found = [refined(take).calibration for take in takes]
    off = np.array([turns(take, one) for take, one in zip(takes, found, strict=True)])
    assert np.all(np.median(off, axis=0) < [3.0, 3.5, 3.5, 2.5])
    away = np.array([levers(take, one) for take, one in zip(takes, found, strict=True)])
    assert np.all(np.median(away, axis=0) < [0.012, 0.02, 0.02, 0.03])


def test_real_people_gain_by_moving() -> None:
    before, after, near, far = [], [], [], []
    for seed in SEEDS:
        take = somebodys_take(seed)
        pose, recording = pose_and_recording(take)
        result = refine_by_movement(pose, recording.between(pose.end_s))
        alone = calibrate_t_pose(pose)
        before.append(turns(take, alone))
        after.append(turns(take, result.calibration))
        far.append(levers(take, alone))
        near.append(levers(take, result.calibration))
    gain = np.mean(after, axis=0) / np.mean(before, axis=0)
    assert np.all(gain[[0, 3]] < 0.8)
    assert np.all((np.mean(near, axis=0) / np.mean(far, axis=0))[:3] < 0.8)


@pytest.mark.parametrize("seed", [3, 4])
def test_a_play_space_that_is_turned_and_shifted_changes_nothing(seed: int) -> None:
    pose, recording = pose_and_recording(somebodys_take(seed))
    R, p = rotation_y(2.2), np.array([1.0, 0.0, -2.0])
    movement = recording.between(pose.end_s)
    elsewhere = Movement(movement.times_s, movement.p @ R.T + p, R @ movement.R, movement.tracked)
    there = TPose(
        pose.serials,
        pose.p @ R.T + p,
        R @ pose.R,
        pose.start_s,
        pose.end_s,
        pose.spread_m,
        pose.spread_rad,
        pose.quality,
    )
    a = refine_by_movement(pose, movement).calibration
    b = refine_by_movement(there, elsewhere).calibration
    np.testing.assert_allclose(a.R_tracker_joint, b.R_tracker_joint, atol=1e-6)
    np.testing.assert_allclose(a.p_tracker_joint, b.p_tracker_joint, atol=1e-6)
    np.testing.assert_allclose(a.body.offsets, b.body.offsets, atol=1e-6)


def test_what_was_not_done_is_asked_for_and_what_was_is_not() -> None:
    pose, recording = pose_and_recording(somebodys_take(1))
    whole = refine_by_movement(pose, recording.between(pose.end_s))
    assert whole.missing == ()
    # the movement's first seconds: the T-pose's end, nodding and the hands
    start = refine_by_movement(pose, recording.between(pose.end_s, pose.end_s + 4.0))
    assert any("walk" in words for words in start.missing)
    assert any("turn" in words for words in start.missing)


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_less_certain_after_the_movement(seed: int) -> None:
    for quantity in refined(somebodys_take(seed)).quantities:
        assert quantity.after < 1.02 * quantity.before


def test_somebody_who_walks_sideways_is_not_believed() -> None:
    pose, recording = pose_and_recording(ideal_take(2, 3.0))
    movement = recording.between(pose.end_s)
    straight = refine_by_movement(pose, movement)
    # every position is carried off at right angles to where it went
    p = np.array(movement.p)
    middle = p[:, 3:4] * [1.0, 0.0, 1.0]
    sideways = p + (middle - middle[:1]) @ (rotation_y(np.pi / 2.0) - np.eye(3)).T
    crab = Movement(movement.times_s, sideways, movement.R, movement.tracked)
    result = refine_by_movement(pose, crab)
    assert straight.missing == ()
    assert any("walk" in words for words in result.missing)
