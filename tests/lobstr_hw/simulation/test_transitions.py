"""Clips put one after another."""

from dataclasses import replace

import numpy as np
import pytest
from support.motions import arms_down, walking

from lobstr_hw.rotations import (
    geodesic_angle,
    heading_angle,
    rotation_x,
    rotation_y,
)
from lobstr_hw.simulation import eased, joined, moved
from lobstr_hw.skeleton import Joint

FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]


def test_one_motion_alone_is_left_as_it_is() -> None:
    walk = walking(2.0)
    same = joined([walk])
    np.testing.assert_array_equal(same.R_local, walk.R_local)
    np.testing.assert_array_equal(same.p_hips, walk.p_hips)


def test_a_joined_motion_has_no_jump() -> None:
    whole = joined([arms_down(1.0), walking(3.0), walking(2.0, seed=3), arms_down(1.0)])
    p, R = whole.joints()
    own = np.max(np.linalg.norm(np.diff(walking(3.0).joints()[0], axis=0), axis=-1))
    assert np.max(np.linalg.norm(np.diff(p, axis=0), axis=-1)) < 1.6 * own
    assert np.rad2deg(np.max(geodesic_angle(R[1:], R[:-1]))) < 15.0


def test_a_later_motion_goes_on_from_where_the_last_one_ended() -> None:
    first, second = walking(3.0), moved(walking(2.0), rotation_y(2.0), np.array([5.0, 0.0, 5.0]))
    whole = joined([first, second])
    end = len(first) + 14  # eased at its end
    start = len(whole) - len(second) - 14
    apart = whole.p_hips[start] - whole.p_hips[end]
    assert np.linalg.norm(apart[[0, 2]]) < 0.05
    yaws = heading_angle(whole.R_local[[end, start], 0])[0]
    assert yaws[0] == pytest.approx(yaws[1], abs=0.05)


def test_a_foot_that_stands_does_not_slide_while_the_other_steps() -> None:
    first, second = arms_down(1.0), walking(2.0)
    whole = joined([first, second])
    p = whole.joints()[0][:, FEET]
    step = slice(len(first) + 14, len(first) + 14 + 53)
    speed = np.linalg.norm(np.diff(p[step], axis=0), axis=-1) * 45.0
    assert np.all(np.min(speed, axis=-1) < 0.02)


def test_easing_keeps_the_way_and_starts_and_ends_at_rest() -> None:
    walk = walking(3.0)
    slow = eased(walk, start=True, end=True)
    np.testing.assert_allclose(slow.p_hips[[0, -1]], walk.p_hips[[0, -1]], atol=1e-12)
    speed = np.linalg.norm(np.diff(slow.p_hips, axis=0), axis=-1)
    normal = np.median(np.linalg.norm(np.diff(walk.p_hips, axis=0), axis=-1))
    assert speed[0] < 0.05 * normal
    assert speed[-1] < 0.05 * normal
    assert np.max(speed) < 1.5 * normal
    middle = len(walk) // 2
    assert np.min(np.linalg.norm(slow.p_hips - walk.p_hips[middle], axis=-1)) == 0.0


def test_moving_there_and_back_is_staying() -> None:
    walk, p = walking(1.0), np.array([1.0, 0.0, 2.0])
    R = rotation_y(0.7)
    back = moved(moved(walk, R, p), R.T, -(R.T @ p))
    np.testing.assert_allclose(back.p_hips, walk.p_hips, atol=1e-12)
    np.testing.assert_allclose(back.R_local, walk.R_local, atol=1e-12)
    np.testing.assert_allclose(back.p_toes, walk.p_toes, atol=1e-12)


@pytest.mark.parametrize("raised_deg", [60.0, 90.0, 120.0])
def test_legs_do_not_flip_on_the_way_into_a_raised_leg(raised_deg: float) -> None:
    standing = arms_down(1.0)
    R = np.array(standing.R_local)
    R[:, Joint.LEFT_UPPER_LEG] = rotation_x(-np.deg2rad(raised_deg))
    R[:, Joint.LEFT_LOWER_LEG] = rotation_x(np.deg2rad(30.0))
    kick = replace(standing, R_local=R)
    R = joined([standing, kick, standing]).R_local
    assert np.rad2deg(np.max(geodesic_angle(R[1:], R[:-1]))) < 15.0


def test_motions_of_different_rates_are_refused() -> None:
    walk = walking(1.0)
    with pytest.raises(ValueError, match="rates differ"):
        joined([walk, replace(walk, rate_hz=30.0)])


def test_a_very_short_motion_can_be_joined() -> None:
    walk = walking(1.0)
    short = replace(walk, p_hips=walk.p_hips[:2], R_local=walk.R_local[:2], p_toes=walk.p_toes[:2])
    whole = joined([walk, short, walk])
    assert np.isfinite(whole.joints()[0]).all()
