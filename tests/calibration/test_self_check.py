"""What is wrong is noticed, with the reason; what is right is left in peace."""

from dataclasses import replace

import numpy as np
import pytest
from support.movers import pose_and_recording, refined, somebodys_movement, somebodys_take

from lobstr_hw.calibration import (
    Movement,
    SelfCheck,
    TPose,
    TPoseDetector,
    check_calibration,
    refine_by_movement,
)
from lobstr_hw.calibration.slips import steps_of
from lobstr_hw.calibration.t_pose import quality_of
from lobstr_hw.simulation import PoseDeviation, SimulatedTake, Sway, simulate, take_samples
from lobstr_hw.simulation.mishaps import any_direction, arms_off_level, seated, slipped, unseen
from lobstr_hw.simulation.t_pose import t_pose_motion
from lobstr_hw.trackers import FOUR_POINTS

IN_THE_POSE_S = 1.6


def judged(take: SimulatedTake) -> SelfCheck:
    pose, recording = pose_and_recording(take)
    return check_calibration(
        pose, recording, refine_by_movement(pose, recording.between(pose.end_s))
    )


def sitting_take(seed: int) -> SimulatedTake:
    rng = np.random.default_rng(seed)
    pose = t_pose_motion(3.0, 45.0, PoseDeviation.drawn(rng, 0.1), Sway(), rng)
    return simulate(somebodys_movement(seed), seed, t_pose=seated(pose, 0.55))


@pytest.mark.parametrize("seed", range(4))
def test_good_ones_pass(seed: int) -> None:
    check = judged(somebodys_take(seed))
    assert check.ok, check.reason
    assert check.reason == ""


@pytest.mark.parametrize("tracker", range(4))
def test_a_tracker_that_slips_in_the_pose_is_named(tracker: int) -> None:
    rng = np.random.default_rng(tracker)
    role = str(FOUR_POINTS[tracker])
    take, when_s = somebodys_take(tracker), IN_THE_POSE_S
    shifted = slipped(take, tracker, when_s, shift=any_direction(rng, 0.03))
    turned = slipped(take, tracker, when_s, turn=any_direction(rng, 0.18))
    for changed in (shifted, turned):
        check = judged(changed)
        assert not check.ok
        assert role in check.failed[0].name
        assert "T-pose again" in check.reason


@pytest.mark.parametrize("seed", range(3))
def test_a_jump_of_the_tracking_is_no_slip(seed: int) -> None:
    _, recording = pose_and_recording(somebodys_take(seed))
    pose = recording.between(0.3, 2.9)
    p = np.array(pose.p)
    p[50:57, 2] += 0.05
    jumped = Movement(pose.times_s, p, pose.R, pose.tracked)
    assert np.max(steps_of(jumped).m) < 0.015


@pytest.mark.parametrize("seed", range(3))
def test_who_sits_is_told_to_stand(seed: int) -> None:
    take = sitting_take(seed)
    detector = TPoseDetector({serial: role for role, serial in take.serials.items()})
    pose = detector.add(s for s in take_samples(take) if s.time_s < 3.0)
    reason = str(detector.failure()) if pose is None else judged(take).reason
    assert "stand" in reason or "arms" in reason


@pytest.mark.parametrize(
    ("risen", "higher_m", "share", "noticed"),
    [
        ((0, 1, 2, 3), 0.2, 1.0, True),
        ((0, 1, 2, 3), 0.2, 0.3, True),
        ((0, 1, 2, 3), 0.2, 0.05, False),
        ((0, 1, 2, 3), 0.06, 1.0, False),
        ((0, 1, 2, 3), -0.3, 1.0, False),
        ((0,), 0.2, 1.0, False),
        ((1, 2, 3), 0.2, 1.0, False),
    ],
)
def test_who_gets_up_for_the_movement_did_not_stand_in_the_pose(
    risen: tuple[int, ...], higher_m: float, share: float, noticed: bool
) -> None:
    pose, recording = pose_and_recording(somebodys_take(2))
    refinement = refine_by_movement(pose, recording.between(pose.end_s))
    p, after = np.array(recording.p), int(np.searchsorted(recording.times_s, pose.end_s))
    part = slice(after, after + round(share * (len(p) - after)))
    p[part, list(risen), 1] = pose.p[list(risen), 1] + higher_m
    check = check_calibration(pose, replace(recording, p=p), refinement)
    gained = [failed for failed in check.failed if failed.name == "height gained"]
    assert bool(gained) == noticed
    assert all("stand up straight" in failed.advice for failed in gained)


@pytest.mark.parametrize("up_deg", [(-35.0, 0.0), (0.0, 32.0), (40.0, 40.0), (-45.0, -30.0)])
def test_arms_off_level_are_not_taken(up_deg: tuple[float, float]) -> None:
    rng = np.random.default_rng(5)
    deviation = arms_off_level(PoseDeviation.none(), (np.deg2rad(up_deg[0]), np.deg2rad(up_deg[1])))
    take = simulate(
        somebodys_movement(5), 5, t_pose=t_pose_motion(3.0, 45.0, deviation, Sway(), rng)
    )
    detector = TPoseDetector({serial: role for role, serial in take.serials.items()})
    found = detector.add(s for s in take_samples(take) if s.time_s < 3.0)
    assert found is None or not judged(take).ok


@pytest.mark.parametrize("order", [(1, 0, 2, 3), (0, 2, 1, 3), (3, 1, 2, 0), (2, 3, 0, 1)])
def test_roles_that_are_exchanged_are_noticed(order: tuple[int, ...]) -> None:
    take = somebodys_take(0)
    pose, recording = pose_and_recording(take)
    at = list(order)
    p, R = pose.p[at], pose.R[at]
    wrong = TPose(
        tuple(np.array(pose.serials)[at]),
        p,
        R,
        pose.start_s,
        pose.end_s,
        pose.spread_m,
        pose.spread_rad,
        quality_of(p, R, pose.spread_m, pose.spread_rad),
    )
    mixed = Movement(
        recording.times_s, recording.p[:, at], recording.R[:, at], recording.tracked[:, at]
    )
    check = check_calibration(wrong, mixed, refine_by_movement(wrong, mixed.between(pose.end_s)))
    assert not check.ok
    assert check.reason


def test_a_tracker_that_is_hardly_seen_is_named() -> None:
    take = somebodys_take(1)
    pose, recording = pose_and_recording(take)
    tracked = np.array(recording.tracked)
    tracked[recording.times_s > pose.end_s, 3] = False
    blind = replace(recording, tracked=tracked)
    check = check_calibration(pose, blind, refine_by_movement(pose, blind.between(pose.end_s)))
    assert not check.ok
    assert check.failed[0].name == "pelvis seen"
    with pytest.raises(AssertionError, match=r"in sight|no tracker"):
        refined(unseen(take, 3))
