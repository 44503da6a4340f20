"""Heel, ball and toe tip never go under the floor, and only as much moves as must."""

import numpy as np
import pytest

from lobstr_hw.floor import FootShape, above_floor, raised, toes_on_floor
from lobstr_hw.ik.vectors import rotate, unit
from lobstr_hw.rotations import from_rotation_vector, geodesic_angle, rotation_x
from lobstr_hw.skeleton import HEEL, STANDARD_OFFSETS, TOE_TIP, Body, Joint


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(29)


def test_the_standard_foot_is_that_of_the_skeleton() -> None:
    shape = FootShape.of(Body.standard())
    np.testing.assert_allclose(
        shape.heel[0, 0], HEEL - STANDARD_OFFSETS[Joint.LEFT_TOES], atol=1e-12
    )
    np.testing.assert_allclose(shape.tip[0, 0], TOE_TIP, atol=1e-12)
    np.testing.assert_allclose(shape.tip_m, 0.010)


def test_flat_stance_is_left_alone() -> None:
    shape = FootShape.of(Body.standard())
    flat = np.broadcast_to(np.eye(3), (1, 2, 3, 3))
    toe = np.array([[[0.1, 0.02, 0.0], [-0.1, 0.02, 0.0]]])
    on, R = above_floor(toe, flat, shape)
    np.testing.assert_allclose(on, toe)
    np.testing.assert_allclose(R, flat, atol=1e-9)
    np.testing.assert_allclose(toes_on_floor(on, R, shape), flat, atol=1e-9)


def test_nothing_of_any_foot_is_under_the_floor(rng: np.random.Generator) -> None:
    n = 2000
    shape = FootShape.of(Body.standard(n))
    toe = rng.normal(scale=0.1, size=(n, 2, 3))
    R_foot = from_rotation_vector(rng.normal(scale=1.2, size=(n, 2, 3)))
    toe, R = above_floor(toe, R_foot, shape)
    R_toes = toes_on_floor(toe, R, shape)
    assert (toe + rotate(R, shape.heel))[..., 1].min() > -1e-9
    assert toe[..., 1].min() >= 0.02
    assert (toe + rotate(R_toes, shape.tip))[..., 1].min() > 0.01 - 1e-9


def test_a_foot_clear_of_the_floor_is_left_alone(rng: np.random.Generator) -> None:
    shape = FootShape.of(Body.standard(200))
    toe = rng.normal(scale=0.05, size=(200, 2, 3)) + np.array([0.0, 0.6, 0.0])
    R_foot = from_rotation_vector(rng.normal(size=(200, 2, 3)))
    same, R = above_floor(toe, R_foot, shape)
    np.testing.assert_array_equal(same, toe)
    np.testing.assert_allclose(R, R_foot, atol=1e-12)
    np.testing.assert_allclose(toes_on_floor(same, R, shape), R_foot, atol=1e-12)


def test_toes_lie_flat_at_push_off() -> None:
    shape = FootShape.of(Body.standard())
    pushing = np.broadcast_to(rotation_x(0.6), (1, 2, 3, 3))  # heel up
    toe = np.array([[[0.1, 0.02, 0.0], [-0.1, 0.02, 0.0]]])
    R_toes = toes_on_floor(toe, pushing, shape)
    np.testing.assert_allclose(
        geodesic_angle(R_toes, np.broadcast_to(np.eye(3), R_toes.shape)), 0.0, atol=1e-6
    )


def test_a_sinking_heel_strike_flattens_without_a_jump() -> None:
    shape = FootShape.of(Body.standard(400))
    heights = np.linspace(0.10, 0.0, 400)
    toe = np.zeros((400, 2, 3))
    toe[..., 1] = heights[:, None]
    strike = np.broadcast_to(rotation_x(-0.4), (400, 2, 3, 3))  # toes up
    _, R = above_floor(toe, strike, shape)
    steps = geodesic_angle(R[1:], R[:-1])
    assert steps.max() < 0.01
    assert geodesic_angle(R[-1], np.broadcast_to(np.eye(3), R[-1].shape)).max() < 1e-2


def test_raising_is_the_smallest_turn(rng: np.random.Generator) -> None:
    v = 0.17 * unit(rng.normal(size=(500, 3)))
    least = rng.uniform(-0.1, 0.1, size=500)
    R = raised(v, least, np.broadcast_to([0.0, 0.0, 1.0], v.shape))
    up = rotate(R, v)
    low = v[:, 1] < least
    np.testing.assert_allclose(up[low, 1], least[low], atol=1e-9)
    np.testing.assert_allclose(up[~low], v[~low], atol=1e-12)
    # the elevation changes, nothing else
    elevation = np.arcsin(np.clip(v[:, 1] / 0.17, -1, 1)) - np.arcsin(
        np.clip(up[:, 1] / 0.17, -1, 1)
    )
    angle = geodesic_angle(R, np.broadcast_to(np.eye(3), R.shape))
    np.testing.assert_allclose(angle, np.abs(elevation), atol=1e-4)


def test_bigger_people_have_bigger_feet() -> None:
    small, big = FootShape.of(Body.standard()), FootShape.of(Body.standard(hips_height_m=1.3))
    np.testing.assert_allclose(big.heel, 1.3 * small.heel)
    np.testing.assert_allclose(big.tip, 1.3 * small.tip)
    np.testing.assert_allclose(big.ball_m, 1.3 * small.ball_m)
