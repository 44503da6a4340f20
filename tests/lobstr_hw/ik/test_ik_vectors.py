"""The fast products agree with the plain ones."""

import numpy as np
import pytest

from lobstr_hw.ik.vectors import (
    align,
    cross,
    faded_angle,
    log_rotation,
    rotate,
    sine_axis,
    swing,
    turn,
    twist_terms,
    unit,
)
from lobstr_hw.rotations import (
    from_rotation_vector,
    heading_angle,
    rotation_between,
    to_rotation_vector,
)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def test_turn_is_the_exponential_map_down_to_no_turn_at_all(rng: np.random.Generator) -> None:
    w = rng.normal(size=(200, 3)) * 10.0 ** rng.uniform(-12, 0, size=(200, 1))
    w[0] = 0.0
    np.testing.assert_allclose(turn(w), from_rotation_vector(w), atol=1e-13)


def test_log_undoes_turn(rng: np.random.Generator) -> None:
    w = unit(rng.normal(size=(300, 3))) * rng.uniform(0.0, 3.0, size=(300, 1))
    np.testing.assert_allclose(log_rotation(turn(w)), w, atol=1e-9)


def test_swing_is_the_shortest_rotation(rng: np.random.Generator) -> None:
    a, b = unit(rng.normal(size=(2, 300, 3)))
    np.testing.assert_allclose(swing(a, b), rotation_between(a, b), atol=1e-9)
    np.testing.assert_allclose(rotate(swing(a, b), a), b, atol=1e-12)


def test_cross_is_the_vector_product(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 100, 3))
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))


def test_twist_about_y_is_the_heading(rng: np.random.Generator) -> None:
    R = from_rotation_vector(rng.normal(size=(100, 3)))
    yaw, certainty = heading_angle(R)
    s, c = twist_terms(R, axis=1)
    np.testing.assert_allclose(np.arctan2(s, c), yaw)
    np.testing.assert_allclose(np.hypot(s, c), certainty)


def test_sine_axis_is_the_axis_times_the_sine(rng: np.random.Generator) -> None:
    R = from_rotation_vector(rng.normal(size=(100, 3)))
    w = to_rotation_vector(R)
    angle = np.linalg.norm(w, axis=-1, keepdims=True)
    np.testing.assert_allclose(sine_axis(R), w / angle * np.sin(angle), atol=1e-9)


def test_a_faded_angle_is_the_angle_where_people_move_and_never_jumps() -> None:
    angle = np.linspace(-np.pi, np.pi, 20_001)
    faded = faded_angle(np.sin(angle), np.cos(angle))
    inside = np.abs(angle) < 2.2
    np.testing.assert_allclose(faded[inside], angle[inside], atol=1e-12)
    assert abs(faded[0]) < 1e-6 and abs(faded[-1]) < 1e-6
    assert np.abs(np.diff(faded)).max() < 6.0 * (angle[1] - angle[0])


def test_align_takes_the_bone_along_and_the_hinge_as_near_as_can_be(
    rng: np.random.Generator,
) -> None:
    bone, hinge, to_bone, to_hinge = unit(rng.normal(size=(4, 100, 3)))
    R = align(bone, hinge, to_bone, to_hinge)
    np.testing.assert_allclose(rotate(R, bone), to_bone, atol=1e-12)
    plane = cross(to_bone, to_hinge)
    np.testing.assert_allclose(np.sum(rotate(R, hinge) * plane, axis=-1), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1.0)
