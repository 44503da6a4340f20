"""Laws of pivots, axes and the fit of orientations."""

import numpy as np
import pytest

from lobstr_hw.calibration.axes import main_axis
from lobstr_hw.calibration.orientation import Direction, fit_orientations
from lobstr_hw.calibration.phases import angular_velocity
from lobstr_hw.calibration.pivot import fit_pivot, windows_of
from lobstr_hw.calibration.priors import IDEAL_DEVICE
from lobstr_hw.rotations import (
    Array,
    from_axis_angle,
    from_rotation_vector,
    geodesic_angle,
    heading_angle,
    normalize,
    rotation_y,
)
from lobstr_hw.simulation.noise import random_rotations, smooth_noise

TIMES = np.arange(180) / 45.0
WINDOWS = windows_of(np.ones(180, dtype=bool), 18)
VAGUE = np.eye(3)


def turning(rng: np.random.Generator) -> Array:
    """Rotations (180, 3, 3) that go through all directions."""
    wandering = from_rotation_vector(smooth_noise(rng, TIMES, 3, 0.5))
    return np.asarray(wandering @ random_rotations(rng, 1)[0])


def about(R: Array, lever: Array, pivot: Array) -> Array:
    """Where a tracker is whose point ``lever`` is at ``pivot``."""
    return pivot - R @ lever


@pytest.mark.parametrize("seed", range(5))
def test_a_point_that_rests_or_drifts_is_found_exactly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lever, R = rng.normal(0.0, 0.1, 3), turning(rng)
    drifting = rng.normal(size=3) + TIMES[:, None] * rng.normal(0.0, 0.1, 3)
    pivot = fit_pivot(about(R, lever, drifting), R, WINDOWS, np.zeros(3), VAGUE, noise_m=0.001)
    np.testing.assert_allclose(pivot.p, lever, atol=1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_without_turning_a_pivot_stays_where_it_was_thought(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = np.broadcast_to(random_rotations(rng, 1)[0], (180, 3, 3))
    p = smooth_noise(rng, TIMES, 3, 0.02)
    prior = rng.normal(0.0, 0.1, 3)
    pivot = fit_pivot(p, R, WINDOWS, prior, VAGUE, noise_m=0.005)
    np.testing.assert_allclose(pivot.p, prior, atol=1e-9)
    np.testing.assert_allclose(pivot.covariance, VAGUE, atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_a_window_in_which_the_joint_went_away_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lever, R = rng.normal(0.0, 0.1, 3), turning(rng)
    joint = smooth_noise(rng, TIMES, 3, 0.0005)
    joint[WINDOWS[3]] += 0.3 * np.sin(np.linspace(0.0, 6.0, 18))[:, None]
    pivot = fit_pivot(about(R, lever, joint), R, WINDOWS, np.zeros(3), VAGUE, noise_m=0.003)
    assert np.linalg.norm(pivot.p - lever) < 0.003


def test_what_turns_about_one_axis_only_leaves_the_lever_along_it_open() -> None:
    axis = normalize(np.array([1.0, 2.0, -1.0]))
    R = from_axis_angle(axis, np.sin(4.0 * TIMES))
    lever = np.array([0.05, 0.02, 0.1])
    pivot = fit_pivot(about(R, lever, np.zeros(3)), R, WINDOWS, np.zeros(3), VAGUE, noise_m=0.001)
    across = np.eye(3) - np.outer(axis, axis)
    np.testing.assert_allclose(across @ pivot.p, across @ lever, atol=1e-4)
    assert axis @ pivot.covariance @ axis == pytest.approx(1.0)
    assert abs(axis @ pivot.p) < 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_the_axis_of_a_turn_is_found_whatever_else_the_tracker_looks_like(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = normalize(rng.normal(size=3))
    R = random_rotations(rng, 1)[0] @ from_axis_angle(axis, 0.6 * np.sin(5.0 * TIMES))
    near = from_rotation_vector(rng.normal(0.0, 0.1, 3)) @ axis
    found = main_axis(angular_velocity(R, 45.0), np.ones(180, dtype=bool), near, 45.0)
    assert found is not None
    np.testing.assert_allclose(found.seen, axis, atol=1e-6)
    assert found.wobble_rad < 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_without_evidence_hands_and_pelvis_are_held_straight(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = np.stack([IDEAL_DEVICE, *random_rotations(rng, 3)])
    yaw = rng.uniform(-3.0, 3.0)
    fit = fit_orientations(rotation_y(yaw) @ R, yaw, [])
    np.testing.assert_allclose(fit.R_joint_tracker, R, atol=1e-9)
    assert np.angle(np.exp(1j * (fit.heading_rad - yaw))) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_two_exact_directions_overrule_the_t_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = np.stack([IDEAL_DEVICE, *random_rotations(rng, 3)])
    held = from_rotation_vector(rng.normal(0.0, 0.1, (4, 3)))
    evidence = [
        Direction(joint, axis, true[joint].T @ axis, np.full(3, 1e-5))
        for joint in range(4)
        for axis in np.eye(3)[:2]
    ]
    fit = fit_orientations(held @ true, 0.0, evidence)
    assert np.max(geodesic_angle(fit.R_joint_tracker, true)) < 1e-4
    assert np.max(fit.deviation) < 1e-4


def test_more_evidence_never_makes_a_joint_less_certain() -> None:
    R = np.stack([IDEAL_DEVICE, *random_rotations(np.random.default_rng(1), 3)])
    up = Direction(3, np.array([0.0, 1.0, 0.0]), R[3, 1], np.array([0.03, np.inf, 0.03]))
    with_it, without = fit_orientations(R, 0.0, [up]), fit_orientations(R, 0.0, [])
    assert np.all(with_it.deviation <= without.deviation + 1e-12)
    assert np.all(with_it.deviation[3, [0, 2]] < 0.6 * without.deviation[3, [0, 2]])
    assert heading_angle(with_it.R_joint_tracker[3] @ R[3].T)[0] == pytest.approx(0.0, abs=1e-6)
