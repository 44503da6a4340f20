"""The contact lock: when it closes and opens, and that a held foot stands still at every rate."""

import numpy as np
import numpy.typing as npt
import pytest

from lobstr_hw.contact import (
    ContactLock,
    LockSettings,
    count_contact_steps,
    follow,
    release,
    toe_target,
)
from lobstr_hw.rotations import Array, rotation_y

SETTINGS = LockSettings()
FLOOR = np.array([[0.02]])
HIP = np.array([[[0.09, 0.9, 0.0], [-0.09, 0.9, 0.0]]])
REACH = np.array([[0.967, 0.967]])
RATES = [45.0, 60.0, 72.0, 90.0, 144.0]
NOBODY = np.zeros((1, 2), dtype=bool)


def tick(
    lock: ContactLock,
    toe: Array,
    probability: float,
    dt_s: float,
    tracked: npt.NDArray[np.bool_] = NOBODY,
) -> tuple[ContactLock, Array]:
    """One tick of a lock alone, without IK: the new state and the toes shown."""
    p, dt = np.full((1, 2), probability), np.array([[dt_s]])
    target = toe_target(lock, toe, dt, SETTINGS)
    opens = release(lock, target, toe, HIP, p, REACH, tracked, SETTINGS)
    return follow(lock, target, toe, opens, ~tracked, dt, FLOOR, SETTINGS), target


def toes(x: float = 0.0, y: float = 0.02, z: float = 0.0) -> Array:
    return np.array([[[0.09 + x, y, z], [-0.09 + x, y, z]]])


def counted(lock: ContactLock, probability: float, steps: int = 1) -> ContactLock:
    for _ in range(steps):
        lock = count_contact_steps(lock, np.full((1, 2), probability), SETTINGS)
    return lock


def locked(toe: Array) -> ContactLock:
    lock, _ = tick(counted(ContactLock.start(1), 0.9, 2), toe, 0.9, 0.02)
    assert lock.on.all()
    return lock


@pytest.mark.parametrize(
    ("probabilities", "closes"),
    [([0.7], False), ([0.7, 0.7], True), ([0.7, 0.5, 0.7], False), ([0.6, 0.6, 0.6], False)],
)
def test_it_closes_after_two_sure_grid_steps_in_a_row(
    probabilities: list[float], closes: bool
) -> None:
    lock = ContactLock.start(1)
    for p in probabilities:
        lock = counted(lock, p)
    lock, _ = tick(lock, toes(), probabilities[-1], 0.02)
    assert lock.on.all() == closes


def test_between_the_thresholds_it_stays_as_it_is() -> None:
    lock, _ = tick(locked(toes()), toes(), 0.45, 0.02)
    assert lock.on.all()
    lock, _ = tick(lock, toes(), 0.39, 0.02)
    assert not lock.on.any()
    lock, _ = tick(counted(lock, 0.55, 5), toes(), 0.55, 0.02)
    assert not lock.on.any()


@pytest.mark.parametrize("rate_hz", RATES)
def test_a_held_toe_stands_still_while_the_network_drifts(rate_hz: float) -> None:
    lock = locked(toes())
    for k in range(round(rate_hz)):
        lock, shown = tick(lock, toes(x=0.1 * k / rate_hz), 0.9, 1.0 / rate_hz)
        np.testing.assert_allclose(shown, toes(), atol=1e-12)
    assert lock.on.all()


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("height_m", [0.045, 0.03])
def test_a_toe_locked_near_the_floor_is_down_within_a_tenth_of_a_second(
    rate_hz: float, height_m: float
) -> None:
    lock = locked(toes(y=height_m))
    elapsed, last = 0.0, height_m
    while elapsed < 0.1 + 1.0 / rate_hz:
        lock, shown = tick(lock, toes(y=height_m), 0.9, 1.0 / rate_hz)
        elapsed += 1.0 / rate_hz
        assert 0.02 - 1e-12 <= shown[0, 0, 1] <= last
        last = shown[0, 0, 1]
        if elapsed < 0.09:
            assert shown[0, 0, 1] > 0.02, "not at once"
    np.testing.assert_allclose(shown[..., 1], 0.02, atol=1e-12)


def test_a_toe_locked_high_up_stays_high_up() -> None:
    # on a rung or a step
    lock = locked(toes(y=0.06))
    for _ in range(20):
        lock, shown = tick(lock, toes(y=0.06), 0.9, 0.02)
    np.testing.assert_allclose(shown[..., 1], 0.06)


@pytest.mark.parametrize("rate_hz", RATES)
def test_after_release_the_toe_goes_to_the_networks_in_the_papers_ten_frames(
    rate_hz: float,
) -> None:
    lock = locked(toes())
    lock, _ = tick(lock, toes(z=0.1), 0.1, 1.0 / rate_hz)
    assert not lock.on.any()
    dt, elapsed, at = 1.0 / rate_hz, 0.0, []
    while elapsed < 0.3:
        lock, shown = tick(lock, toes(z=0.1), 0.1, dt)
        elapsed += dt
        at.append((elapsed, shown[0, 0, 2]))
    times, z = np.array(at).T
    blend = np.minimum(times / SETTINGS.release_s, 1.0)
    np.testing.assert_allclose(z, 0.1 * (0.5 - 0.5 * np.cos(np.pi * blend)), atol=1e-9)
    assert z[-1] == 0.1


def test_a_release_starts_where_the_foot_was_held() -> None:
    lock = locked(toes())
    _, shown = tick(lock, toes(z=0.14), 0.1, 0.02)
    np.testing.assert_allclose(shown, toes())


@pytest.mark.parametrize("stray_m", [0.14, 0.16])
def test_a_lock_far_from_the_networks_toe_opens(stray_m: float) -> None:
    lock, _ = tick(locked(toes()), toes(z=stray_m), 0.9, 0.02)
    assert lock.on.all() == (stray_m < SETTINGS.distance_m)


def test_a_lock_out_of_the_legs_reach_opens() -> None:
    far = toes(z=0.5)
    assert np.linalg.norm(far - HIP, axis=-1).min() > 0.99 * 0.967
    lock, _ = tick(locked(far), far, 0.9, 0.02)
    assert not lock.on.any()


def test_after_an_early_release_it_locks_again_only_near_the_networks_toe() -> None:
    lock, _ = tick(locked(toes()), toes(z=0.2), 0.9, 0.02)
    lock = counted(lock, 0.9, 2)
    shown_z = []
    while not lock.on.all():
        lock, shown = tick(lock, toes(z=0.2), 0.9, 0.02)
        shown_z.append(shown[0, 0, 2])
    assert shown_z[-1] > 0.2 - SETTINGS.close_within_m
    assert all(z <= 0.2 - SETTINGS.close_within_m for z in shown_z[:-1])


def test_a_foot_said_to_stand_all_the_time_follows_a_walking_network() -> None:
    # the lock closes and opens again and again; it must not leave the foot behind for good
    lock, dt = ContactLock.start(1), 1.0 / 45.0
    for k in range(10 * 45):
        toe = toes(z=1.0 * k * dt)
        lock, shown = tick(counted(lock, 0.9), toe, 0.9, dt)
        # held back by the lock, then by what the network walks on during the blend
        assert toe[0, 0, 2] - shown[0, 0, 2] < SETTINGS.distance_m + 1.0 * SETTINGS.release_s


def test_a_foot_with_a_tracker_is_never_locked() -> None:
    tracked = np.array([[True, False]])
    lock, _ = tick(counted(ContactLock.start(1), 0.9, 5), toes(), 0.9, 0.02, tracked)
    np.testing.assert_array_equal(lock.on, [[False, True]])
    lock, _ = tick(locked(toes()), toes(), 0.9, 0.02, tracked)
    np.testing.assert_array_equal(lock.on, [[False, True]])


@pytest.mark.parametrize("dt_s", [0.0, 1e-9, 5.0])
def test_any_tick_length_is_finite(dt_s: float) -> None:
    lock = locked(toes())
    for p in (0.9, 0.1, 0.1, 0.9):
        lock, shown = tick(counted(lock, p), toes(z=0.05), p, dt_s)
        assert np.isfinite(shown).all()


def test_a_shifted_world_takes_the_held_toe_along() -> None:
    T = np.eye(4)[None].copy()
    T[0, :3, :3] = rotation_y(0.7)
    T[0, :3, 3] = [1.0, 0.3, -2.0]
    lock = locked(toes()).shifted(T)
    _, shown = tick(lock, toes(), 0.9, 0.02)
    np.testing.assert_allclose(shown, toes() @ rotation_y(0.7).T + T[0, :3, 3])
