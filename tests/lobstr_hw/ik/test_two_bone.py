"""Laws of the two-bone limb: FK(IK(x)) = x, no bone is ever stretched, the knee does not jump."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lobstr_hw.ik.two_bone import bend_and_swing, limb_rotations, solve_two_bone, stretch_towards
from lobstr_hw.ik.vectors import cross, rotate, unit
from lobstr_hw.rotations import Array, from_rotation_vector

UPPER, LOWER = 0.43, 0.41


def directions(rng: np.random.Generator, n: int) -> Array:
    return unit(rng.normal(size=(n, 3)))


def end_of(p_mid: Array, target: Array) -> Array:
    return np.asarray(p_mid + LOWER * unit(target - p_mid))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def test_a_target_in_reach_is_met(rng: np.random.Generator) -> None:
    root = rng.normal(size=(500, 3))
    target = root + directions(rng, 500) * rng.uniform(0.03, 0.84, size=(500, 1))
    p_mid = solve_two_bone(root, target, UPPER, LOWER, directions(rng, 500))
    np.testing.assert_allclose(np.linalg.norm(target - p_mid, axis=-1), LOWER, atol=1e-9)
    np.testing.assert_allclose(end_of(p_mid, target), target, atol=1e-9)


@pytest.mark.parametrize("distance_m", [0.0, 0.01, 0.84, 0.9, 3.0])
def test_no_bone_is_ever_stretched(rng: np.random.Generator, distance_m: float) -> None:
    root = rng.normal(size=(200, 3))
    target = root + distance_m * directions(rng, 200)
    p_mid = solve_two_bone(root, target, UPPER, LOWER, directions(rng, 200))
    np.testing.assert_allclose(np.linalg.norm(p_mid - root, axis=-1), UPPER, atol=1e-9)


def test_a_target_too_far_is_pointed_at(rng: np.random.Generator) -> None:
    root, way = rng.normal(size=(100, 3)), directions(rng, 100)
    p_mid = solve_two_bone(root, root + 2.0 * way, UPPER, LOWER, directions(rng, 100))
    np.testing.assert_allclose(p_mid, root + UPPER * way, atol=1e-9)


def test_the_mid_joint_is_on_the_side_of_the_pole(rng: np.random.Generator) -> None:
    root, pole = np.zeros((300, 3)), directions(rng, 300)
    target = directions(rng, 300) * 0.6
    p_mid = solve_two_bone(root, target, UPPER, LOWER, pole)
    across = p_mid - np.sum(p_mid * unit(target), axis=-1, keepdims=True) * unit(target)
    assert np.all(np.sum(across * pole, axis=-1) > 0.0)


def test_a_pole_along_the_limb_still_gives_a_finite_limb() -> None:
    down = np.array([0.0, -1.0, 0.0])
    p_mid = solve_two_bone(np.zeros(3), 0.5 * down, UPPER, LOWER, 7.0 * down)
    assert np.linalg.norm(p_mid) == pytest.approx(UPPER)
    assert np.linalg.norm(p_mid - 0.5 * down) == pytest.approx(LOWER)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 0.80))
def test_a_small_step_of_the_target_is_a_small_step_of_the_knee(
    seed: int, distance_m: float
) -> None:
    rng = np.random.default_rng(seed)
    target = distance_m * directions(rng, 50)
    pole = directions(rng, 50)
    # far from the one direction in which the pole says nothing
    far = np.linalg.norm(cross(unit(target), pole), axis=-1) > 0.3
    moved = target + 1e-5 * directions(rng, 50)
    before = solve_two_bone(np.zeros(3), target, UPPER, LOWER, pole)
    after = solve_two_bone(np.zeros(3), moved, UPPER, LOWER, pole)
    assert np.linalg.norm(after - before, axis=-1)[far].max() < 5e-4


def test_rotations_put_the_bones_on_the_solved_joints(rng: np.random.Generator) -> None:
    n = 200
    root, pole = rng.normal(size=(n, 3)), directions(rng, n)
    target = root + 0.7 * directions(rng, n)
    p_mid = solve_two_bone(root, target, UPPER, LOWER, pole)
    upper = np.broadcast_to([0.0, -UPPER, 0.0], (n, 3))
    lower = np.broadcast_to([0.0, -LOWER, 0.0], (n, 3))
    hinge = np.array([1.0, 0.0, 0.0])
    to_hinge = cross(target - root, pole)
    R_upper, R_lower = limb_rotations(root, p_mid, target, (upper, lower), hinge, to_hinge)
    end = root + rotate(R_upper, upper) + rotate(R_lower, lower)
    np.testing.assert_allclose(end, target, atol=1e-9)
    for R in (R_upper, R_lower):
        np.testing.assert_allclose(
            R @ np.swapaxes(R, -1, -2), np.tile(np.eye(3), (n, 1, 1)), atol=1e-9
        )
        np.testing.assert_allclose(R @ hinge, unit(to_hinge), atol=1e-9)


def test_bending_and_swinging_meets_the_target_and_keeps_the_twist(
    rng: np.random.Generator,
) -> None:
    n = 300
    R = from_rotation_vector(rng.normal(size=(n, 3)))
    hinge = R[..., 0]
    upper = rotate(R, np.array([0.02, -UPPER, 0.0]))
    lower = rotate(
        R @ from_rotation_vector(np.array([0.4, 0.05, 0.03])), np.array([0.0, -LOWER, 0.0])
    )
    target = directions(rng, n) * rng.uniform(0.15, 0.80, size=(n, 1))
    R_bend, R_swing, end = bend_and_swing(upper, lower, hinge, target)
    np.testing.assert_allclose(end, target, atol=1e-9)
    np.testing.assert_allclose(rotate(R_bend, hinge), hinge, atol=1e-9)
    posed = rotate(R_swing, upper + rotate(R_bend, lower))
    np.testing.assert_allclose(posed, target, atol=1e-9)


def test_a_limb_that_is_there_already_is_left_alone(rng: np.random.Generator) -> None:
    R = from_rotation_vector(rng.normal(size=(100, 3)))
    upper = rotate(R, np.array([0.0, -UPPER, 0.0]))
    bend = from_rotation_vector(rng.uniform(0.1, 1.5, size=(100, 1)) * np.array([1.0, 0.0, 0.0]))
    lower = rotate(R @ bend, np.array([0.0, -LOWER, 0.0]))
    R_bend, R_swing, _ = bend_and_swing(upper, lower, R[..., 0], upper + lower)
    np.testing.assert_allclose(R_swing @ R_bend, np.tile(np.eye(3), (100, 1, 1)), atol=1e-6)


def test_a_first_bone_turns_only_for_an_end_out_of_reach(rng: np.random.Generator) -> None:
    bone = 0.145 * directions(rng, 500)
    line = directions(rng, 500) * rng.uniform(0.1, 0.6, size=(500, 1))
    reach = np.full((500, 1), 0.5)
    R = stretch_towards(bone, line, reach, np.pi)
    was = np.linalg.norm(line - bone, axis=-1)
    now = np.linalg.norm(line - rotate(R, bone), axis=-1)
    np.testing.assert_allclose(now[was < 0.5], was[was < 0.5], atol=1e-9)
    np.testing.assert_allclose(now[was > 0.5], 0.5, atol=1e-7)
    assert (was > 0.5).any() and (was < 0.5).any()
