"""What is lost goes on with the part of the body next to it."""

from dataclasses import replace

import numpy as np
import pytest

from lobstr_hw.features import Points
from lobstr_hw.lost_points import HIGHEST_HIPS, follow
from lobstr_hw.rotations import from_rotation_vector, heading_angle, rotation_y

PELVIS, HEAD, LEFT, RIGHT = range(4)
ALL = np.ones((3, 4), dtype=bool)


def points(seed: int = 0) -> Points:
    rng = np.random.default_rng(seed)
    p = np.array([[0.0, 0.9, 0.0], [0.0, 1.6, 0.1], [0.4, 1.0, 0.3], [-0.3, 1.2, 0.2]])
    p = p + 0.05 * rng.standard_normal((3, 4, 3))
    R = from_rotation_vector(0.3 * rng.standard_normal((3, 4, 3)))
    return Points(p, R, ALL, ALL, R[:, 0])


def without(points: Points, *roles: int) -> Points:
    """Lost; what stands in their place means nothing."""
    p, R, valid = points.p.copy(), points.R.copy(), ALL.copy()
    p[:, roles], R[:, roles], valid[:, roles] = 7.0, np.eye(3), False
    return Points(p, R, valid, valid, points.R_ref)


def lost_before(points: Points, *roles: int) -> Points:
    valid = ALL.copy()
    valid[:, roles] = False
    return replace(points, valid_p=valid, valid_R=valid)


def test_where_nothing_is_lost_nothing_is_guessed() -> None:
    before, now = points(0), points(1)
    assert follow(before, now, ALL) is now


@pytest.mark.parametrize("roles", [(PELVIS,), (HEAD,), (LEFT,), (PELVIS, LEFT)])
def test_a_body_that_glides_takes_along_whoever_is_lost(roles: tuple[int, ...]) -> None:
    before = lost_before(points(), *roles)
    now = replace(points(), p=before.p + np.array([0.02, 0.0, -0.01]))
    guess = follow(before, without(now, *roles), ALL)
    assert guess.p == pytest.approx(now.p)
    assert guess.R == pytest.approx(now.R)


def test_a_hand_stays_before_a_pelvis_that_turns() -> None:
    before, turn = points(), rotation_y(0.1)
    now = replace(before, p=before.p @ turn.T, R=turn @ before.R)
    guess = follow(before, without(now, LEFT), ALL)
    assert guess.p == pytest.approx(now.p)
    assert guess.R == pytest.approx(now.R)


def test_a_lost_pelvis_turns_with_head_and_hands_more_than_with_the_head_alone() -> None:
    before, turn = lost_before(points(), PELVIS), rotation_y(0.1)

    def yaw(*turning: int) -> float:
        R = before.R.copy()
        R[:, turning] = turn @ R[:, turning]
        guess = follow(before, without(replace(before, R=R), PELVIS), ALL)
        return float(heading_angle(guess.R[0, PELVIS] @ before.R[0, PELVIS].T)[0])

    assert 0.0 < yaw(LEFT) < yaw(HEAD) < yaw(HEAD, LEFT) < yaw(HEAD, LEFT, RIGHT) < 0.1
    assert yaw(LEFT) == pytest.approx(yaw(RIGHT))


def test_a_hand_that_was_never_seen_turns_no_pelvis() -> None:
    before, seen = lost_before(points(), PELVIS, LEFT), ALL.copy()
    seen[:, LEFT] = False
    for placeholder in (
        rotation_y(0.3) @ before.R[:, LEFT],
        np.full((len(before.R), 3, 3), np.nan),
    ):
        now = without(replace(before, R=before.R.copy()), PELVIS, LEFT)
        now.R[:, LEFT] = placeholder
        guess = follow(before, now, seen)
        assert guess.R[:, PELVIS] == pytest.approx(before.R[:, PELVIS])


def test_what_is_measured_is_left_alone() -> None:
    before, now = points(0), points(1)
    now = replace(now, valid_p=without(now, PELVIS).valid_p)
    guess = follow(before, now, ALL)
    assert (guess.R == now.R).all()
    assert (guess.p[:, 1:] == now.p[:, 1:]).all()
    assert np.abs(guess.p[:, PELVIS] - now.p[:, PELVIS]).max() > 1e-3


def test_what_was_never_seen_is_left_alone() -> None:
    gone = without(points(1), PELVIS)
    seen = ALL.copy()
    seen[:, PELVIS] = False
    assert (follow(points(0), gone, seen).p == gone.p).all()


def test_pelvis_and_head_lost_together_stay() -> None:
    before = lost_before(points(0), PELVIS, HEAD)
    guess = follow(before, without(points(1), PELVIS, HEAD), ALL)
    assert guess.p[:, :2] == pytest.approx(before.p[:, :2])
    assert guess.R[:, :2] == pytest.approx(before.R[:, :2])


def test_a_pelvis_that_comes_back_elsewhere_pushes_no_lost_hand() -> None:
    before = lost_before(points(0), PELVIS, LEFT)
    now = points(0)
    now.p[:, PELVIS] += 0.4
    guess = follow(before, without(now, LEFT), ALL)
    assert guess.p[:, LEFT] == pytest.approx(before.p[:, LEFT])


def test_hips_lost_in_a_bow_do_not_float_when_the_head_comes_up() -> None:
    before = points()
    now = replace(before, p=before.p + np.array([0.0, 0.6, 0.0]))
    guess = follow(before, without(now, PELVIS), ALL)
    assert guess.p[:, PELVIS, 1] == pytest.approx(HIGHEST_HIPS)
