"""Heading, the headset's share, and the fit of the measures."""

import numpy as np
import pytest
from support.calibrations import mean_body

from lobstr_hw.calibration.heading import (
    hands_heading,
    head_mount,
    headset_heading,
    pose_heading,
    turn_between,
)
from lobstr_hw.calibration.measures import Measures, fit_measures
from lobstr_hw.calibration.priors import BELLY_LEVER, IDEAL_DEVICE, WAND_LEVER
from lobstr_hw.proportions import eyes_in_head
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    geodesic_angle,
    rotation_x,
    rotation_y,
    to_rotation_vector,
)
from lobstr_hw.simulation.noise import random_rotations
from lobstr_hw.skeleton import Joint, forward_kinematics

MIRROR = np.array([-1.0, 1.0, 1.0])


def trackers(stature_m: float) -> Array:
    """Where the trackers (4, 3) of the expected person are."""
    body = mean_body(stature_m)
    straight = np.broadcast_to(np.eye(3), (22, 3, 3))
    p = forward_kinematics(straight, body.offsets[0, 0], body.offsets[0])[0]
    return np.stack(
        [
            p[Joint.HEAD] + eyes_in_head(np.array(stature_m)),
            p[Joint.LEFT_HAND] + WAND_LEVER,
            p[Joint.RIGHT_HAND] + WAND_LEVER * MIRROR,
            p[Joint.HIPS] + BELLY_LEVER,
        ]
    )


def fit(p: Array, stature_m: float | None = None) -> Measures:
    return fit_measures(p, np.eye(3), stature_m)


@pytest.mark.parametrize("yaw", np.linspace(-3.1, 3.1, 9))
def test_hands_and_headset_of_a_turned_person_give_the_turn(yaw: float) -> None:
    R = rotation_y(yaw)
    left, right = R @ [0.7, 1.4, 0.0], R @ [-0.7, 1.4, 0.0]
    assert hands_heading(left, right) == pytest.approx(yaw, abs=1e-9)
    assert headset_heading(R @ IDEAL_DEVICE) == pytest.approx(yaw, abs=1e-9)
    found, disagreement = pose_heading(left, right, R @ IDEAL_DEVICE)
    assert found == pytest.approx(yaw, abs=1e-9)
    assert disagreement == pytest.approx(0.0, abs=1e-9)


def test_the_heading_lies_between_hands_and_headset_nearer_to_the_hands() -> None:
    left, right = np.array([0.7, 1.4, 0.0]), np.array([-0.7, 1.4, 0.0])
    found, _ = pose_heading(left, right, rotation_y(0.2) @ IDEAL_DEVICE)
    assert 0.0 < found < 0.1


def test_a_headset_that_looks_elsewhere_is_left_out_of_the_heading() -> None:
    left, right = np.array([0.7, 1.4, 0.0]), np.array([-0.7, 1.4, 0.0])
    found, disagreement = pose_heading(left, right, rotation_y(1.5) @ IDEAL_DEVICE)
    assert found == pytest.approx(0.0, abs=1e-9)
    assert disagreement == pytest.approx(1.5)


def test_turns_go_the_short_way() -> None:
    assert turn_between(3.1, -3.1) == pytest.approx(6.2 - 2.0 * np.pi)


@pytest.mark.parametrize("seed", range(5))
def test_head_and_headset_make_what_was_seen(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R_seen = from_rotation_vector(rng.normal(0.0, 0.1, 3)) @ IDEAL_DEVICE
    R_head, R_mount = head_mount(R_seen)
    np.testing.assert_allclose(R_head @ R_mount, R_seen, atol=1e-12)


def test_the_headset_gets_most_of_the_pitch_and_little_of_the_roll() -> None:
    def share(axis: int) -> float:
        off = np.zeros(3)
        off[axis] = 0.1
        mount = head_mount(from_rotation_vector(off) @ IDEAL_DEVICE)[1]
        return float(to_rotation_vector(mount @ IDEAL_DEVICE.T)[axis] / 0.1)

    pitch, yaw, roll = (share(axis) for axis in range(3))
    assert 1.0 > pitch > 0.5 > yaw > 0.0
    assert 0.5 > roll > 0.0


def test_a_device_that_no_headset_prior_fits_is_taken_at_its_word() -> None:
    R_seen = random_rotations(np.random.default_rng(1), 1)[0]
    R_head, R_mount = head_mount(R_seen)
    assert float(geodesic_angle(R_head, np.eye(3))) < 1e-9
    np.testing.assert_allclose(R_mount, R_seen, atol=1e-12)


@pytest.mark.parametrize("stature_m", [1.4, 1.7, 2.0])
def test_the_expected_person_fits_without_residual(stature_m: float) -> None:
    found = fit(trackers(stature_m))
    assert found.stature_m == pytest.approx(stature_m, abs=1e-7)
    assert found.hips_height_m == pytest.approx(0.586 * stature_m, abs=1e-7)
    assert found.misfit < 1e-4


def test_where_the_person_stands_does_not_matter() -> None:
    p = trackers(1.75) + np.random.default_rng(0).normal(0.0, 0.01, (4, 3))
    a, b = fit(p), fit(p + np.array([7.0, 0.0, -3.0]))
    np.testing.assert_allclose(a.levers, b.levers, atol=1e-9)
    assert a.hips_height_m == pytest.approx(b.hips_height_m, abs=1e-9)


def test_a_mirrored_person_has_the_same_measures_and_mirrored_levers() -> None:
    p = trackers(1.75) + np.random.default_rng(1).normal(0.0, 0.01, (4, 3))
    a, b = fit(p), fit(p[[0, 2, 1, 3]] * MIRROR)
    assert a.arm_m == pytest.approx(b.arm_m, abs=1e-9)
    assert a.hips_height_m == pytest.approx(b.hips_height_m, abs=1e-9)
    np.testing.assert_allclose(a.levers[[0, 2, 1, 3]] * MIRROR, b.levers, atol=1e-9)


def test_a_higher_headset_makes_legs_and_trunk_longer_and_wider_hands_the_arms() -> None:
    p = trackers(1.7)
    higher, wider = p.copy(), p.copy()
    higher[0, 1] += 0.02
    wider[1, 0] += 0.03
    wider[2, 0] -= 0.03
    normal, tall, wide = fit(p), fit(higher), fit(wider)
    assert tall.hips_height_m > normal.hips_height_m
    assert tall.trunk_m > normal.trunk_m
    assert wide.arm_m > normal.arm_m + 0.01
    # one who is broad is a little taller than the headset says, but only a little
    assert 0.0 < wide.hips_height_m - normal.hips_height_m < 0.004


@pytest.mark.parametrize("seed", range(3))
def test_the_steps_are_enough(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    p = trackers(1.7) + rng.normal(0.0, 0.04, (4, 3))
    few = fit_measures(p, rotation_x(0.1))
    monkeypatch.setattr("lobstr_hw.calibration.measures.STEPS", 20)
    many = fit_measures(p, rotation_x(0.1))
    assert few.hips_height_m == pytest.approx(many.hips_height_m, abs=1e-4)
    assert few.arm_m == pytest.approx(many.arm_m, abs=1e-4)
    np.testing.assert_allclose(few.levers, many.levers, atol=1e-4)


def test_deviations_are_what_the_errors_of_random_people_are() -> None:
    """The fit's own word on its uncertainty, against people drawn from its priors."""
    rng = np.random.default_rng(7)
    misses = []
    for _ in range(200):
        leg = 1.0 + rng.normal(0.0, 0.025)
        stature = rng.uniform(1.5, 1.95)
        p = trackers(stature)
        hips = 0.586 * stature * leg
        p[3, 1] = hips + BELLY_LEVER[1] + rng.normal(0.0, 0.045)
        p[[1, 2], 1] += rng.normal(0.0, 0.045, 2)
        p[0, 1] += rng.normal(0.0, 0.012)
        found = fit(p)
        misses.append((found.hips_height_m - hips) / found.hips_height_deviation_m)
    assert 0.7 < np.std(misses) < 1.3
