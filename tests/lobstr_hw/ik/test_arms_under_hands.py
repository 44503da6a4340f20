"""Laws of the arms: wrists in reach are met, bones are never stretched, elbows do not flip."""

import numpy as np
import pytest

from lobstr_hw.ik.arms import solve_arms
from lobstr_hw.ik.vectors import rotate, turn, unit
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle, slerp
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

MIRROR = np.array([-1.0, 1.0, 1.0])
ARM_M = 0.525
RESTING = STANDARD_OFFSETS[[6, 10]] + STANDARD_OFFSETS[[7, 11]]


def offsets(n: int) -> Array:
    return np.broadcast_to(STANDARD_OFFSETS, (n, 22, 3))


def solve(p_hand: Array, R_hand: Array) -> Array:
    n = len(p_hand)
    eye = np.broadcast_to(np.eye(3), (n, 3, 3))
    return solve_arms(np.zeros((n, 3)), eye, p_hand, R_hand, offsets(n))


def joints(arms: Array) -> tuple[Array, Array, Array]:
    """Upper arm, elbow and wrist (n, 2, 3) of a chest at the origin."""
    p_upper = STANDARD_OFFSETS[[6, 10]] + rotate(arms[:, :, 0], STANDARD_OFFSETS[[7, 11]])
    p_elbow = p_upper + rotate(arms[:, :, 1], STANDARD_OFFSETS[[8, 12]])
    return p_upper, p_elbow, p_elbow + rotate(arms[:, :, 2], STANDARD_OFFSETS[[9, 13]])


def hands(rng: np.random.Generator, n: int, closest: float = 0.2) -> tuple[Array, Array]:
    """Hands anywhere that the resting shoulders reach, turned any way within 90 degrees or so."""
    way = unit(rng.normal(size=(n, 2, 3)))
    p = RESTING + way * ARM_M * rng.uniform(closest, 1.0, size=(n, 2, 1))
    return p, from_rotation_vector(rng.normal(scale=0.8, size=(n, 2, 3)))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(23)


def test_a_wrist_that_the_resting_shoulder_reaches_is_met(rng: np.random.Generator) -> None:
    p_hand, R_hand = hands(rng, 3000)
    np.testing.assert_allclose(joints(solve(p_hand, R_hand))[2], p_hand, atol=1e-6)


def test_the_shoulder_helps_a_hand_just_out_of_reach(rng: np.random.Generator) -> None:
    out = np.array(
        [[[0.55, 0.16, 0.36], [-0.55, 0.16, 0.36]], [[0.18, 0.65, 0.05], [-0.18, 0.65, 0.05]]]
    )
    away = np.linalg.norm(out - RESTING, axis=-1)
    assert np.all(away > ARM_M)
    R_hand = np.broadcast_to(np.eye(3), (2, 2, 3, 3))
    np.testing.assert_allclose(joints(solve(out, R_hand))[2], out, atol=1e-6)


def test_out_of_reach_the_arm_is_straight_and_points_at_the_hand(rng: np.random.Generator) -> None:
    p_hand = RESTING + 2.0 * unit(rng.normal(size=(300, 2, 3)))
    p_upper, p_elbow, p_wrist = joints(solve(p_hand, hands(rng, 300)[1]))
    line = unit(p_hand - p_upper)
    np.testing.assert_allclose(p_wrist - p_upper, ARM_M * line, atol=1e-6)
    np.testing.assert_allclose(p_elbow - p_upper, 0.28 * line, atol=1e-6)


def test_the_t_pose_is_nearly_the_identity() -> None:
    p_hand = (STANDARD_OFFSETS[[6, 10]] + STANDARD_OFFSETS[[7, 11]] + STANDARD_OFFSETS[[8, 12]]
              + STANDARD_OFFSETS[[9, 13]])[None]  # fmt: skip
    arms = solve(p_hand, np.broadcast_to(np.eye(3), (1, 2, 3, 3)))
    angle = geodesic_angle(arms, np.broadcast_to(np.eye(3), arms.shape))
    assert angle[:, :, 0].max() < 2e-2
    assert angle.max() < np.deg2rad(25.0), "the elbow points back, and a little down"


def test_left_and_right_mirror_each_other(rng: np.random.Generator) -> None:
    p_hand, R_hand = hands(rng, 200)
    arms = solve(p_hand, R_hand)
    flip = np.outer(MIRROR, MIRROR)
    mirrored = solve(p_hand[:, ::-1] * MIRROR, R_hand[:, ::-1] * flip)
    np.testing.assert_allclose(mirrored[:, ::-1] * flip, arms, atol=1e-9)


def test_every_rotation_is_one(rng: np.random.Generator) -> None:
    arms = solve(*hands(rng, 500, closest=0.0))
    np.testing.assert_allclose(
        arms @ np.swapaxes(arms, -1, -2), np.broadcast_to(np.eye(3), arms.shape), atol=1e-9
    )
    np.testing.assert_allclose(np.linalg.det(arms), 1.0)


def paths(rng: np.random.Generator) -> tuple[Array, Array]:
    """Left hands on minimum-jerk ways between everyday places: (ways, steps, 3) and rotations."""
    places = np.array(
        [
            [0.20, -0.45, 0.08],  # hanging
            [0.10, -0.05, 0.40],  # in front
            [-0.20, 0.05, 0.25],  # at the other shoulder
            [0.30, 0.45, 0.15],  # up
            [0.12, 0.28, -0.05],  # behind the head
            [0.05, -0.30, -0.18],  # behind the back
            [0.55, 0.05, 0.10],  # to the side
        ]
    )
    turns = np.array(
        [
            [0.0, 0.0, -1.4],
            [0.0, -1.3, 0.0],
            [0.0, -2.4, 0.0],
            [0.0, 0.0, 1.4],
            [0.0, -2.6, 1.0],
            [0.0, 2.6, -0.8],
            [0.0, 0.0, 0.0],
        ]
    )
    a, b = np.meshgrid(np.arange(7), np.arange(7))
    a, b = a.ravel()[a.ravel() != b.ravel()], b.ravel()[a.ravel() != b.ravel()]
    t = np.linspace(0.0, 1.0, 400)[:, None]
    w = t**3 * (10.0 - 15.0 * t + 6.0 * t * t)
    # the hand goes round the body and the shoulder, not through them
    middle = 0.5 * (places[a] + places[b])
    behind = (places[a][:, 2] < 0.0) != (places[b][:, 2] < 0.0)
    middle = middle + behind[:, None] * [0.35, 0.0, 0.15]
    p = (
        (1 - w) ** 2 * places[a][:, None]
        + 2 * w * (1 - w) * middle[:, None]
        + w**2 * places[b][:, None]
    )
    start, end = turn(turns[a]), turn(turns[b])
    R = slerp(start[:, None], end[:, None], w[:, 0])
    return p, R


def test_elbows_do_not_flip_between_everyday_places(rng: np.random.Generator) -> None:
    p, R = paths(rng)
    ways, steps = p.shape[:2]
    p_hand = np.stack([p, p * MIRROR], axis=2).reshape(-1, 2, 3)
    R_hand = np.stack([R, R * np.outer(MIRROR, MIRROR)], axis=2).reshape(-1, 2, 3, 3)
    p_elbow = joints(solve(p_hand, R_hand))[1][:, 0].reshape(ways, steps, 3)
    speed = np.linalg.norm(np.diff(p_elbow, axis=1), axis=-1) * steps
    # the hand's own peak speed on such a way is under 2.5 m per way
    assert speed.max() < 6.0


def test_small_steps_of_the_hand_are_small_steps_of_the_elbow(rng: np.random.Generator) -> None:
    p_hand, R_hand = hands(rng, 10_000, closest=0.3)
    near = np.linalg.norm(p_hand - RESTING, axis=-1) < 0.9 * ARM_M
    before = joints(solve(p_hand, R_hand))[1]
    moved = p_hand + 1e-5 * unit(rng.normal(size=p_hand.shape))
    after = joints(solve(moved, turn(1e-5 * rng.normal(size=p_hand.shape)) @ R_hand))[1]
    ratio = (np.linalg.norm(after - before, axis=-1) / 1e-5)[near]
    assert np.percentile(ratio, 99.0) < 10.0
    # on a sphere of directions some must be ambiguous; hands turned that way are no one's
    assert (ratio > 100.0).mean() < 1e-3


def test_joint_numbers_are_those_of_the_skeleton() -> None:
    assert (Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER, Joint.LEFT_HAND) == (6, 10, 9)
