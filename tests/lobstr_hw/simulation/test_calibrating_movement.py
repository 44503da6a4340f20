"""People who move to be calibrated are people."""

import numpy as np
import pytest
from support.movers import somebodys_movement

from lobstr_hw.rotations import geodesic_angle, heading_angle
from lobstr_hw.simulation import Habits, calibrating_movement
from lobstr_hw.skeleton import Joint

SEEDS = range(8)
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]
TRACKED = [Joint.HIPS, Joint.HEAD, Joint.LEFT_HAND, Joint.RIGHT_HAND]


@pytest.mark.parametrize("seed", SEEDS)
def test_one_foot_at_least_stands_still_and_none_is_under_the_floor(seed: int) -> None:
    p, _ = somebodys_movement(seed).joints()
    speed = np.linalg.norm(np.diff(p[:, TOES], axis=0), axis=-1) * 45.0
    assert np.max(np.min(speed, axis=1)) < 0.3
    assert np.min(p[:, TOES, 1]) > 0.015


@pytest.mark.parametrize("seed", SEEDS)
def test_nobody_is_faster_than_people_are(seed: int) -> None:
    motion = somebodys_movement(seed)
    p, R = motion.joints()
    assert 5.0 < motion.duration_s < 12.0
    assert np.max(np.linalg.norm(np.diff(p[:, Joint.HIPS], axis=0), axis=-1)) * 45.0 < 2.5
    turn = geodesic_angle(R[1:], R[:-1]) * 45.0
    assert np.rad2deg(np.max(turn[:, TRACKED])) < 700.0


@pytest.mark.parametrize("seed", SEEDS)
def test_everything_that_was_asked_for_is_done(seed: int) -> None:
    p, R = somebodys_movement(seed).joints()
    yaw = np.unwrap(heading_angle(R[:, Joint.HIPS])[0])
    assert np.rad2deg(np.ptp(yaw)) > 200.0
    way = p[:, Joint.HIPS][:, [0, 2]]
    assert np.max(np.linalg.norm(way - way[0], axis=-1)) > 0.5
    trunk = p[:, Joint.UPPER_CHEST] - p[:, Joint.SPINE]
    tilt = np.arctan2(np.hypot(trunk[:, 0], trunk[:, 2]), trunk[:, 1])
    assert np.rad2deg(np.max(tilt)) > 15.0


def test_the_same_seeds_move_alike_and_others_do_not() -> None:
    np.testing.assert_array_equal(somebodys_movement(1).R_local, somebodys_movement(1).R_local)
    assert somebodys_movement(1, 1).R_local.shape != somebodys_movement(2, 1).R_local.shape or (
        not np.allclose(somebodys_movement(1, 1).R_local, somebodys_movement(2, 1).R_local)
    )


def test_one_person_keeps_their_habits() -> None:
    habits = Habits.drawn(np.random.default_rng(3))
    again = Habits.drawn(np.random.default_rng(3))
    np.testing.assert_array_equal(habits.twist_axis, again.twist_axis)
    a, b = (calibrating_movement(habits, np.random.default_rng(time)) for time in (1, 2))
    assert len(a) != len(b) or not np.allclose(a.R_local, b.R_local)
