"""One second at the start of every session."""

from dataclasses import replace

import numpy as np
import pytest
from support.movers import refined, somebodys_take

from lobstr_hw.calibration import (
    Movement,
    check_devices,
    check_start,
    movement_from_samples,
)
from lobstr_hw.errors import ProfileError
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import from_rotation_vector
from lobstr_hw.simulation import PoseDeviation, SimulatedUser, Sway, simulate, take_samples
from lobstr_hw.simulation.mishaps import arms_off_level, seated
from lobstr_hw.simulation.t_pose import t_pose_motion
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

SEEDS = (1, 2, 3)
HANGING = (np.deg2rad(-72.0), np.deg2rad(-70.0))


def second(user: SimulatedUser, seed: int, *, sitting: bool = False) -> Movement:
    """Standing with hanging arms."""
    rng = np.random.default_rng(seed)
    deviation = arms_off_level(PoseDeviation.drawn(rng, np.deg2rad(5.0)), HANGING)
    motion = t_pose_motion(1.2, 45.0, deviation, Sway(), rng)
    motion = seated(motion, 0.55) if sitting else motion
    take = simulate(motion, seed + 50, user=user, t_pose_s=0.0)
    return movement_from_samples(take_samples(take), [user.serials[r] for r in FOUR_POINTS])


def strapped_anew(user: SimulatedUser, role: TrackerRole, p: list[float], w: list[float]):  # type: ignore[no-untyped-def]
    T = user.mounts[role]
    moved = Pose(from_rotation_vector(np.array(w)) @ T.R, T.p + np.array(p))
    return replace(user, mounts={**user.mounts, role: moved})


@pytest.mark.parametrize("seed", SEEDS)
def test_the_same_person_with_the_same_trackers_hears_nothing(seed: int) -> None:
    take = somebodys_take(seed)
    result = check_start(refined(take).calibration, second(take.user, seed))
    assert result.standing
    assert result.ok, result.warnings


@pytest.mark.parametrize("seed", SEEDS)
def test_a_pelvis_tracker_that_has_slipped_is_told(seed: int) -> None:
    take = somebodys_take(seed)
    calibration = refined(take).calibration
    for p, w in (([0.0, -0.08, 0.0], [0.0, 0.0, 0.0]), ([0.0, 0.0, 0.0], [0.0, 1.2, 0.0])):
        user = strapped_anew(take.user, TrackerRole.PELVIS, p, w)
        result = check_start(calibration, second(user, seed))
        assert any("pelvis" in words for words in result.warnings)
        assert all("lobstr-calibrate" in words or "look" in words for words in result.warnings)


def test_who_does_not_stand_is_not_warned() -> None:
    take = somebodys_take(1)
    result = check_start(refined(take).calibration, second(take.user, 1, sitting=True))
    assert not result.standing
    assert result.warnings == ()


def test_too_little_to_look_at_says_nothing() -> None:
    take = somebodys_take(1)
    whole = second(take.user, 1)
    short = whole.between(0.0, 0.3)
    assert not check_start(refined(take).calibration, short).standing
    blind = replace(whole, tracked=np.zeros_like(whole.tracked))
    assert not check_start(refined(take).calibration, blind).standing


def test_devices_of_the_profile_are_accepted_with_their_roles_or_without() -> None:
    calibration = refined(somebodys_take(1)).calibration
    check_devices(calibration, dict(calibration.roles))
    check_devices(calibration, dict.fromkeys(calibration.roles))
    check_devices(calibration, {**calibration.roles, "another": TrackerRole.LEFT_FOOT})


@pytest.mark.parametrize("role", FOUR_POINTS)
def test_a_device_that_is_not_there_any_more_is_refused_with_the_way_out(role: TrackerRole) -> None:
    calibration = refined(somebodys_take(1)).calibration
    serial = calibration.serial_of(role)
    seen = {s: r for s, r in calibration.roles.items() if s != serial} | {"LHR-NEW": role}
    with pytest.raises(ProfileError, match=f"{role} is {serial}.*LHR-NEW.*lobstr-calibrate"):
        check_devices(calibration, seen)


def test_a_role_that_has_changed_is_refused_with_the_way_out() -> None:
    calibration = refined(somebodys_take(1)).calibration
    left = calibration.serial_of(TrackerRole.LEFT_HAND)
    right = calibration.serial_of(TrackerRole.RIGHT_HAND)
    assert left is not None
    assert right is not None
    seen = {**calibration.roles, left: TrackerRole.RIGHT_HAND, right: TrackerRole.LEFT_HAND}
    with pytest.raises(ProfileError, match=r"was the left_hand.*lobstr-calibrate"):
        check_devices(calibration, seen)
