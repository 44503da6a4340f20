import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lobstr_hw.rotations import (
    Array,
    from_quat_xyzw,
    from_rotation_vector,
    geodesic_angle,
    rotation_y,
)
from lobstr_hw.runtime.resampling import CAPACITY, History

seeds = st.integers(0, 2**32 - 1)


def filled(times: Array, p: Array, R: Array) -> History:
    history = History(1)
    for time, position, rotation in zip(times, p, R, strict=True):
        history.add(0, float(time), position, rotation)
    return history


def random_poses(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    return rng.normal(size=(n, 3)), from_quat_xyzw(rng.normal(size=(n, 4)))


def moving(seed: int, times: Array) -> tuple[Array, Array]:
    """A steady motion at some times."""
    p_0, v, w = np.random.default_rng(seed).normal(size=(3, 3))
    return p_0 + times[:, None] * v, from_rotation_vector(times[:, None] * w)


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_at_the_time_of_a_sample_it_is_the_sample(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(1e-3, 0.03, 9))
    p, R = random_poses(rng, 9)
    seen = filled(times, p, R).at(times.tolist())
    np.testing.assert_allclose(seen.p[:, 0], p, atol=1e-12)
    assert geodesic_angle(seen.R[:, 0], R).max() < 1e-7
    assert seen.valid_p.all()
    assert seen.valid_R.all()


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_steady_motion_is_exact_between_and_shortly_beyond(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(2e-3, 0.02, 12))
    asked = rng.uniform(times[0], times[-1] + 0.025, 20)
    seen = filled(times, *moving(seed, times)).at(asked.tolist())
    p, R = moving(seed, asked)
    np.testing.assert_allclose(seen.p[:, 0], p, atol=1e-9)
    assert geodesic_angle(seen.R[:, 0], R).max() < 1e-7


def test_beyond_25_ms_the_pose_holds() -> None:
    times = np.arange(10) / 90.0
    last = times[-1] + 0.025
    held = filled(times, *moving(1, times)).at([last, last + 0.025, last + 5.0])
    p, R = moving(1, np.full(3, last))
    np.testing.assert_allclose(held.p[:, 0], p, atol=1e-9)
    assert geodesic_angle(held.R[:, 0], R).max() < 1e-7
    assert held.valid_p[:, 0].tolist() == [True, True, False]


def test_the_slope_beyond_is_that_of_the_last_10_ms_not_of_the_last_sample() -> None:
    times = np.arange(30) / 1000.0
    p = np.zeros((30, 3))
    p[:, 0] = times  # one metre a second
    p[-1, 0] += 1e-4  # the jitter of the last sample
    R = np.tile(np.eye(3), (30, 1, 1))
    beyond = filled(times, p, R).at([times[-1] + 0.01]).p[0, 0, 0]
    assert beyond == pytest.approx(times[-1] + 0.01 + 2e-4, abs=1e-9)


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_turning_and_moving_the_world_turns_and_moves_the_result(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(1e-3, 0.03, 8))
    p, R = random_poses(rng, 8)
    turn, shift = rotation_y(rng.uniform(-3, 3)), rng.normal(size=3)
    asked = rng.uniform(times[0], times[-1] + 0.04, 6).tolist()
    here = filled(times, p, R).at(asked)
    there = filled(times, p @ turn.T + shift, turn @ R).at(asked)
    np.testing.assert_allclose(there.p, here.p @ turn.T + shift, atol=1e-9)
    np.testing.assert_allclose(there.R, turn @ here.R, atol=1e-7)


def test_a_single_sample_holds_everywhere() -> None:
    p, R = random_poses(np.random.default_rng(2), 1)
    seen = filled(np.array([1.0]), p, R).at([0.5, 1.0, 1.01, 9.0])
    np.testing.assert_allclose(seen.p[:, 0], p.repeat(4, axis=0))
    assert seen.valid_R[:, 0].tolist() == [False, True, True, False]


def test_samples_that_are_not_newer_are_left_out() -> None:
    history = filled(np.array([1.0, 1.1]), *random_poses(np.random.default_rng(3), 2))
    assert not history.add(0, 1.1, np.zeros(3), np.eye(3))
    assert not history.add(0, 1.05, np.zeros(3), np.eye(3))
    assert history.newest_s(0) == 1.1


def test_a_role_never_heard_is_finite_and_not_valid() -> None:
    seen = History(2).at([0.0, 1.0])
    assert np.isfinite(seen.p).all()
    assert np.isfinite(seen.R).all()
    assert not seen.valid_p.any()
    assert not seen.valid_R.any()


def test_without_position_the_rotation_stays_valid() -> None:
    history = History(1)
    history.add(0, 0.0, np.ones(3), np.eye(3))
    history.add(0, 0.01, None, rotation_y(0.1))
    seen = history.at([0.01])
    assert seen.valid_R[0, 0]
    assert not seen.valid_p[0, 0]
    np.testing.assert_allclose(seen.p[0, 0], 1.0)


@pytest.mark.parametrize("rate_hz", [30.0, 90.0, 1000.0, 8000.0])
def test_a_long_stream_never_outgrows_its_buffer(rate_hz: float) -> None:
    history = History(1)
    n = 3 * CAPACITY
    for i in range(n):
        t = i / rate_hz
        assert history.add(0, t, np.array([t, 0.0, 0.0]), np.eye(3))
    newest = (n - 1) / rate_hz
    back = min(0.25, 0.2 * CAPACITY / rate_hz)
    seen = history.at([newest, newest - back])
    np.testing.assert_allclose(seen.p[:, 0, 0], [newest, newest - back], atol=1e-9)
