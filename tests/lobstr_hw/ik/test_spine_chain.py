"""Laws of the spine: the head is met, no bone is stretched, nothing snaps."""

import numpy as np
import pytest

from lobstr_hw.ik.spine import solve_spine
from lobstr_hw.ik.vectors import rotate, turn
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    geodesic_angle,
    rotation_x,
    rotation_y,
    rotation_z,
)
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

CHAIN_M = float(STANDARD_OFFSETS[2:6, 1].sum())
HANDS = np.array([[0.3, 0.9, 0.2], [-0.3, 0.9, 0.2]])


def offsets(n: int) -> Array:
    return np.broadcast_to(STANDARD_OFFSETS, (n, 22, 3))


def reached(p_hips: Array, R_hips: Array, spine: Array) -> Array:
    """Where the head joint comes to be (n, 3)."""
    chain = np.concatenate([R_hips[:, None], spine], axis=1)
    return np.asarray(p_hips + rotate(chain, offsets(len(p_hips))[:, 1:6]).sum(axis=1))


def solve(p_hips: Array, R_hips: Array, p_head: Array, R_head: Array) -> Array:
    hands = np.broadcast_to(HANDS, (len(p_hips), 2, 3))
    return solve_spine(p_hips, R_hips, p_head, R_head, hands, offsets(len(p_hips)))


def people(rng: np.random.Generator, n: int) -> tuple[Array, Array, Array, Array]:
    """Hips and heads of people who bow, lean, crouch and look about."""
    p_hips = rng.normal(scale=0.3, size=(n, 3)) + np.array([0.0, 0.9, 0.0])
    R_hips = rotation_y(rng.uniform(-3, 3, n)) @ rotation_x(rng.uniform(-0.3, 0.8, n))
    lean = rotation_x(rng.uniform(-0.4, 1.2, n)) @ rotation_z(rng.uniform(-0.5, 0.5, n))
    line = rotate(R_hips @ lean, np.array([0.0, 1.0, 0.0]))
    spine = p_hips + rotate(R_hips, STANDARD_OFFSETS[Joint.SPINE])
    p_head = spine + line * CHAIN_M * rng.uniform(0.7, 1.0, size=(n, 1))
    R_head = R_hips @ rotation_y(rng.uniform(-1.9, 1.9, n)) @ rotation_x(rng.uniform(-0.8, 0.8, n))
    return p_hips, R_hips, p_head, R_head


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(17)


def test_the_head_is_met_wherever_the_chain_allows(rng: np.random.Generator) -> None:
    p_hips, R_hips, p_head, R_head = people(rng, 2000)
    end = reached(p_hips, R_hips, solve(p_hips, R_hips, p_head, R_head))
    np.testing.assert_allclose(end, p_head, atol=1e-6)


def test_the_t_pose_is_the_identity() -> None:
    eye, hips = np.eye(3)[None], np.array([[0.0, 1.0, 0.0]])
    head = hips + STANDARD_OFFSETS[1:6].sum(axis=0)
    np.testing.assert_allclose(
        solve(hips, eye, head, eye), np.broadcast_to(np.eye(3), (1, 4, 3, 3)), atol=1e-6
    )


@pytest.mark.parametrize("excess_m", [0.001, 0.05, 1.0])
def test_a_head_too_far_is_approached_along_the_line_to_it(excess_m: float) -> None:
    eye, hips = np.eye(3)[None], np.array([[0.0, 1.0, 0.0]])
    spine = hips + STANDARD_OFFSETS[Joint.SPINE]
    way = rotation_x(0.3)[None] @ rotation_z(0.2)
    line = rotate(way, np.array([0.0, 1.0, 0.0]))
    head = spine + (CHAIN_M + excess_m) * line
    end = reached(hips, eye, solve(hips, eye, head, eye))
    np.testing.assert_allclose(end, spine + CHAIN_M * line, atol=1e-6)


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_a_head_much_too_near_gives_a_finite_bent_spine(share: float) -> None:
    eye, hips = np.eye(3)[None], np.array([[0.0, 1.0, 0.0]])
    head = hips + STANDARD_OFFSETS[Joint.SPINE] + np.array([0.0, share * CHAIN_M, 0.0])
    spine = solve(hips, eye, head, eye)
    assert np.isfinite(spine).all()
    identity = np.broadcast_to(np.eye(3), (1, 4, 3, 3))
    np.testing.assert_allclose(spine @ np.swapaxes(spine, -1, -2), identity, atol=1e-9)


def test_random_walks_through_poses_never_snap(rng: np.random.Generator) -> None:
    # 200 people walk 50 small steps each through the space of poses
    p_hips, R_hips, p_head, R_head = people(rng, 200)
    p_head = p_hips + 0.98 * (p_head - p_hips)  # a chain not quite straight: see the next test
    before = solve(p_hips, R_hips, p_head, R_head)
    worst = 0.0
    for _ in range(50):
        R_hips = turn(rng.normal(scale=0.002, size=(200, 3))) @ R_hips
        R_head = turn(rng.normal(scale=0.002, size=(200, 3))) @ R_head
        p_head = p_head + rng.normal(scale=0.0003, size=(200, 3))
        after = solve(p_hips, R_hips, p_head, R_head)
        worst = max(worst, float(geodesic_angle(before, after).max()))
        before = after
    assert worst < 0.1, "less than 6 degrees for steps of 0.1 degree and 0.3 mm"


def test_a_chain_bends_out_of_straightness_no_faster_than_geometry_has_it() -> None:
    # the angle goes with the square root of what is missing: 24 (1 - chord / length)
    eye, hips = np.tile(np.eye(3), (200, 1, 1)), np.tile([0.0, 1.0, 0.0], (200, 1))
    missing = np.linspace(0.0, 0.02, 200)
    head = hips + STANDARD_OFFSETS[1:6].sum(axis=0) - missing[:, None] * [0.0, 1.0, 0.0]
    bend = geodesic_angle(solve(hips, eye, head, eye)[:, 0], eye)
    assert np.all(bend <= np.sqrt(24.0 * missing / 0.365) + 1e-3)
    assert np.all(np.diff(bend) > -1e-6)


def test_looking_from_over_one_shoulder_to_the_other_is_smooth() -> None:
    yaw = np.linspace(-np.pi, np.pi, 2001)
    n = len(yaw)
    eye, hips = np.tile(np.eye(3), (n, 1, 1)), np.tile([0.0, 1.0, 0.0], (n, 1))
    head = hips + STANDARD_OFFSETS[1:6].sum(axis=0) - [0.0, 0.01, 0.0]
    spine = solve(hips, eye, head, rotation_y(yaw))
    steps = geodesic_angle(spine[1:], spine[:-1]).max()
    assert steps < 5.0 * (yaw[1] - yaw[0])


def test_twist_goes_up_from_joint_to_joint() -> None:
    eye, hips = np.eye(3)[None], np.array([[0.0, 1.0, 0.0]])
    head = hips + STANDARD_OFFSETS[1:6].sum(axis=0) - [0.0, 0.005, 0.0]
    spine = solve(hips, eye, head, rotation_y(np.array([1.2])))
    yaw = np.arctan2(spine[0, :, 0, 2] - spine[0, :, 2, 0], spine[0, :, 0, 0] + spine[0, :, 2, 2])
    assert np.all(np.diff(np.concatenate([[0.0], yaw, [1.2]])) > 0.0)
    assert yaw[3] > 2.0 * yaw[2], "the neck turns more than the chest"


def test_it_does_not_matter_where_the_person_stands_and_faces(rng: np.random.Generator) -> None:
    p_hips, R_hips, p_head, R_head = people(rng, 100)
    hands = p_hips[:, None] + rng.normal(scale=0.3, size=(100, 2, 3))
    T = from_rotation_vector(np.array([0.0, 2.1, 0.0]))
    shift = np.array([3.0, 0.4, -2.0])
    here = solve_spine(p_hips, R_hips, p_head, R_head, hands, offsets(100))
    there = solve_spine(
        p_hips @ T.T + shift, T @ R_hips, p_head @ T.T + shift, T @ R_head,
        hands @ T.T + shift, offsets(100),
    )  # fmt: skip
    np.testing.assert_allclose(there, T @ here, atol=1e-6)
