"""Rotations hold their laws, against scipy as an independent judge."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lobstr_hw import rotations as rot

RANDOM = Rotation.random(200, random_state=1)
R = RANDOM.as_matrix()
OTHER = Rotation.random(200, random_state=2).as_matrix()


def test_6d_packs_z_then_y_in_a_row() -> None:
    assert np.array_equal(rot.to_6d(np.eye(3)), [0, 0, 1, 0, 1, 0])


def test_6d_unpacks_what_it_packed() -> None:
    assert np.allclose(rot.from_6d(rot.to_6d(R)), R, atol=1e-12)


def test_6d_of_any_six_numbers_is_a_rotation_that_keeps_z() -> None:
    r6 = np.random.default_rng(3).normal(size=(200, 6))
    M = rot.from_6d(r6)
    assert np.allclose(M @ rot.transpose(M), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(M), 1.0)
    assert np.allclose(rot.angle_between(M[:, :, 2], r6[:, :3]), 0.0, atol=1e-7)


def test_quaternions_agree_with_scipy_and_come_back() -> None:
    q = rot.to_quat_xyzw(R)
    assert np.allclose(q, RANDOM.as_quat(canonical=True), atol=1e-12)
    assert np.allclose(rot.from_quat_xyzw(q), R, atol=1e-12)


def test_half_turns_survive_every_form() -> None:
    half_turns = np.stack([np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])])
    assert np.allclose(rot.from_quat_xyzw(rot.to_quat_xyzw(half_turns)), half_turns)
    assert np.allclose(rot.from_rotation_vector(rot.to_rotation_vector(half_turns)), half_turns)
    assert np.allclose(rot.geodesic_angle(np.eye(3), half_turns), np.pi)


@pytest.mark.parametrize("order", ["ZXY", "YXZ", "XYZ", "XZY", "ZYX", "YZX"])
def test_euler_angles_agree_with_scipy(order: str) -> None:
    assert np.allclose(rot.to_euler(order, R), RANDOM.as_euler(order), atol=1e-9)
    assert np.allclose(rot.from_euler(order, rot.to_euler(order, R)), R, atol=1e-9)


@pytest.mark.parametrize("middle", [np.pi / 2, -np.pi / 2])
@pytest.mark.parametrize("order", ["ZXY", "YXZ", "XYZ", "XZY", "ZYX", "YZX"])
def test_euler_angles_in_gimbal_lock_still_give_the_rotation(order: str, middle: float) -> None:
    M = rot.from_euler(order, np.array([0.4, middle, -0.9]))
    assert np.allclose(rot.from_euler(order, rot.to_euler(order, M)), M, atol=1e-9)


def test_exponential_and_logarithm_are_inverse_down_to_tiny_turns() -> None:
    axes = np.random.default_rng(4).normal(size=(200, 3))
    for size in (1e-9, 1e-4, 1.0):
        w = size * axes / np.linalg.norm(axes, axis=-1, keepdims=True)
        assert np.allclose(rot.to_rotation_vector(rot.from_rotation_vector(w)), w, atol=1e-14)


def test_slerp_ends_at_both_ends_and_turns_evenly() -> None:
    assert np.allclose(rot.slerp(R, OTHER, 0.0), R)
    assert np.allclose(rot.slerp(R, OTHER, 1.0), OTHER, atol=1e-9)
    third = rot.geodesic_angle(R, rot.slerp(R, OTHER, 1.0 / 3.0))
    assert np.allclose(3.0 * third, rot.geodesic_angle(R, OTHER), atol=1e-9)


def test_rotation_between_takes_one_direction_to_the_other_even_the_opposite() -> None:
    a, b = R[:, :, 0], OTHER[:, :, 0]
    for target in (b, -a, a):
        turned = (rot.rotation_between(a, target) @ a[..., None])[..., 0]
        assert np.allclose(turned, target, atol=1e-9)


def test_mean_of_small_turns_both_ways_is_the_middle() -> None:
    w = 0.1 * np.random.default_rng(5).normal(size=(50, 3))
    around = R[0] @ rot.from_rotation_vector(np.concatenate([w, -w]))
    assert np.allclose(rot.rotation_mean(around), R[0], atol=1e-12)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(yaw=st.floats(-3.1, 3.1), pitch=st.floats(-1.4, 1.4), roll=st.floats(-0.5, 0.5))
def test_heading_follows_the_yaw_of_the_world_whatever_the_tilt(
    yaw: float, pitch: float, roll: float
) -> None:
    tilted = rot.rotation_x(pitch) @ rot.rotation_z(roll)
    before, _ = rot.heading_angle(tilted)
    after, certainty = rot.heading_angle(rot.rotation_y(yaw) @ tilted)
    assert certainty > 0.2
    assert np.allclose(np.cos(after - before - yaw), 1.0)


def test_heading_does_not_flip_when_bowing_past_the_horizontal() -> None:
    for pitch in np.linspace(0.0, 2.4, 50):
        assert np.allclose(rot.heading(rot.rotation_x(pitch)), np.eye(3), atol=1e-9)


def test_heading_keeps_the_last_good_one_when_upside_down() -> None:
    last = rot.rotation_y(1.0)
    assert np.allclose(rot.heading(rot.rotation_x(np.pi), last), last)
    assert np.allclose(rot.heading(np.eye(3), last), np.eye(3))
