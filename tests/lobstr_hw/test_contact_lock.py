"""The contact lock: when it closes and opens, and that a held foot stands still at every rate."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from lobstr_hw.contact import ContactLock, LockSettings, follow, release, smoothed, toe_target
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
    """One tick of a lock alone, without IK: the new state and the toes shown.

    The person walks with the toes: the hips stay over them.
    """
    p, dt = np.full((1, 2), probability), np.array([[dt_s]])
    hip = HIP + toe.mean(axis=1, keepdims=True) * [1.0, 0.0, 1.0]
    lock, toe = smoothed(lock, toe, hip, dt, SETTINGS)
    lock, target = toe_target(lock, toe, dt, FLOOR, SETTINGS)
    opens = release(lock, target, toe, HIP, p, REACH, tracked, SETTINGS)
    return follow(lock, target, toe, opens, p, ~tracked, dt, SETTINGS), target


def toes(x: float = 0.0, y: float = 0.02, z: float = 0.0) -> Array:
    return np.array([[[0.09 + x, y, z], [-0.09 + x, y, z]]])


def locked(toe: Array) -> ContactLock:
    lock, _ = tick(ContactLock.start(1), toe, 0.9, 0.02)
    assert lock.on.all()
    return lock


@pytest.mark.parametrize(
    ("probabilities", "closes"),
    [([0.7], True), ([0.6], False), ([0.7, 0.5], True), ([0.7, 0.2], False), ([0.2, 0.5], False)],
)
def test_it_closes_when_contact_is_sure_and_opens_when_it_is_not_any_more(
    probabilities: list[float], closes: bool
) -> None:
    lock = ContactLock.start(1)
    for p in probabilities:
        lock, _ = tick(lock, toes(), p, 0.02)
    assert lock.on.all() == closes


@pytest.mark.parametrize("rate_hz", RATES)
def test_a_held_toe_stands_still_while_the_network_drifts(rate_hz: float) -> None:
    lock = locked(toes())
    for k in range(round(rate_hz)):
        lock, shown = tick(lock, toes(x=0.1 * k / rate_hz), 0.9, 1.0 / rate_hz)
        np.testing.assert_allclose(shown, toes(), atol=1e-12)
    assert lock.on.all()


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("height_m", [0.045, 0.03])
def test_a_toe_locked_near_the_floor_is_down_within_a_tenth_of_a_second_and_not_at_once(
    rate_hz: float, height_m: float
) -> None:
    lock = locked(toes(y=height_m))
    elapsed, last = 0.0, height_m
    fastest = SETTINGS.floor_within_m / SETTINGS.floor_s
    while elapsed < 0.1:
        lock, shown = tick(lock, toes(y=height_m), 0.9, 1.0 / rate_hz)
        elapsed += 1.0 / rate_hz
        assert max(0.02, height_m - fastest * elapsed) - 1e-9 <= shown[0, 0, 1] <= last
        last = shown[0, 0, 1]
    np.testing.assert_allclose(shown[..., 1], 0.02, atol=1e-12)


def test_a_toe_locked_high_up_is_as_high_as_the_networks() -> None:
    # on a rung or a step
    lock = locked(toes(y=0.06))
    for _ in range(20):
        lock, shown = tick(lock, toes(y=0.06), 0.9, 0.02)
    np.testing.assert_allclose(shown[..., 1], 0.06)


def test_a_toe_locked_in_the_air_comes_down_with_the_networks() -> None:
    # contact was told too early; the foot must not float through its stance
    lock = locked(toes(y=0.10))
    for k in range(40):
        lock, shown = tick(lock, toes(y=max(0.10 - 0.005 * k, 0.02)), 0.9, 0.02)
    assert lock.on.all()
    np.testing.assert_allclose(shown, toes(), atol=1e-12)


@pytest.mark.parametrize("rate_hz", RATES)
def test_after_release_what_it_was_off_goes_as_on_a_damped_spring_at_every_rate(
    rate_hz: float,
) -> None:
    lock, dt = locked(toes()), 1.0 / rate_hz
    for _ in range(2):  # the network comes to rest, still held
        lock, _ = tick(lock, toes(z=0.1), 0.9, dt)
    lock, shown = tick(lock, toes(z=0.1), 0.1, dt)
    assert not lock.on.any()
    np.testing.assert_allclose(shown, toes(), atol=1e-12)
    at = []
    for k in range(1, round(0.4 * rate_hz)):
        lock, shown = tick(lock, toes(z=0.1), 0.1, dt)
        at.append((k * dt, shown[0, 0, 2]))
    times, z = np.array(at).T
    rate = 2.0 * np.log(2.0) / SETTINGS.release_s
    np.testing.assert_allclose(z, 0.1 - 0.1 * (1.0 + rate * times) * np.exp(-rate * times))
    assert z[-1] > 0.099


def test_a_release_starts_where_the_foot_was_held_and_from_rest() -> None:
    lock, dt = locked(toes()), 1e-3
    for k in range(50):
        lock, before = tick(lock, toes(z=1.0 * k * dt), 0.9, dt)
    lock, shown = tick(lock, toes(z=0.05), 0.1, dt)
    np.testing.assert_allclose(shown, before, atol=1e-12)
    lock, after = tick(lock, toes(z=0.051), 0.1, dt)
    assert 0.0 <= after[0, 0, 2] - shown[0, 0, 2] < 0.1 * 1.0 * dt


@pytest.mark.parametrize("more_m", [-0.01, 0.01])
def test_a_lock_far_from_the_networks_toe_opens(more_m: float) -> None:
    lock, _ = tick(locked(toes()), toes(z=SETTINGS.distance_m + more_m), 0.9, 0.02)
    assert lock.on.all() == (more_m < 0.0)


def test_a_lock_out_of_the_legs_reach_opens() -> None:
    far = toes(z=0.5)
    assert np.linalg.norm(far - HIP, axis=-1).min() > 0.99 * 0.967
    lock, _ = tick(locked(far), far, 0.9, 0.02)
    assert not lock.on.any()


def test_after_an_early_release_it_locks_again_only_near_the_networks_toe() -> None:
    lock, _ = tick(locked(toes()), toes(z=0.2), 0.9, 0.02)
    shown_z = []
    while not lock.on.all():
        lock, shown = tick(lock, toes(z=0.2), 0.9, 0.02)
        shown_z.append(shown[0, 0, 2])
    assert len(shown_z) > 2
    assert shown_z[-1] > 0.2 - SETTINGS.close_within_m
    assert all(z <= 0.2 - SETTINGS.close_within_m for z in shown_z[:-1])


def test_a_foot_said_to_stand_all_the_time_follows_a_walking_network() -> None:
    # the lock closes and opens again and again; it must not leave the foot behind for good
    lock, dt = ContactLock.start(1), 1.0 / 45.0
    for k in range(10 * 45):
        toe = toes(z=1.0 * k * dt)
        lock, shown = tick(lock, toe, 0.9, dt)
        # held back by the lock, then by what the network walks on while the foot gets under way
        assert toe[0, 0, 2] - shown[0, 0, 2] < SETTINGS.distance_m + 1.0 * SETTINGS.release_s


def test_a_foot_with_a_tracker_is_never_locked() -> None:
    tracked = np.array([[True, False]])
    lock, _ = tick(ContactLock.start(1), toes(), 0.9, 0.02, tracked)
    np.testing.assert_array_equal(lock.on, [[False, True]])
    lock, _ = tick(locked(toes()), toes(), 0.9, 0.02, tracked)
    np.testing.assert_array_equal(lock.on, [[False, True]])


def test_a_step_of_the_leg_is_not_delayed_and_its_trembling_is_taken_away() -> None:
    rng, dt = np.random.default_rng(5), 1.0 / 45.0
    walk = [toes(z=1.5 * k * dt) for k in range(100)]
    noise = [0.01 * rng.normal(size=(1, 2, 3)) for _ in range(100)]
    still = np.array([shown_leg(walk, dt, k) for k in (20, 60, 99)])
    np.testing.assert_allclose(still, [walk[20], walk[60], walk[99]], atol=1e-3)
    given = [w + n for w, n in zip(walk, noise, strict=True)]
    trembling = [
        np.diff(shown_leg(given, dt, settings=replace(SETTINGS, smooth_s=memory_s)) - walk, 3, 0)
        for memory_s in (0.025, 0.05, 0.1)
    ]
    share = [t.std() / np.diff(noise, n=3, axis=0).std() for t in trembling]
    assert share[2] < share[1] < share[0] < 1.0
    assert share[1] < 0.5


def shown_leg(
    walk: list[Array], dt_s: float, at: int | None = None, settings: LockSettings = SETTINGS
) -> Array:
    """The smoothed toes of a leg that moves under hips at rest: at one tick, or at all."""
    lock, out = ContactLock.start(1), []
    for toe in walk:
        lock, shown = smoothed(lock, toe, HIP, np.array([[dt_s]]), settings)
        lock = follow(
            lock, shown, shown, NOBODY, np.zeros((1, 2)), ~NOBODY, np.array([[dt_s]]), settings
        )
        out.append(shown)
    return np.array(out) if at is None else out[at]


def test_how_the_hips_move_is_measured_and_not_smoothed() -> None:
    rng, lock = np.random.default_rng(6), ContactLock.start(1)
    for _ in range(20):
        jump = np.array([rng.normal(), 0.0, rng.normal()])
        lock, shown = tick(lock, toes() + jump, 0.0, 0.02)
        np.testing.assert_allclose(shown, toes() + jump, atol=1e-9)


@pytest.mark.parametrize("dt_s", [0.0, 1e-9, 5.0])
def test_any_tick_length_is_finite(dt_s: float) -> None:
    lock = locked(toes())
    for p in (0.9, 0.1, 0.1, 0.9):
        lock, shown = tick(lock, toes(z=0.05), p, dt_s)
        assert np.isfinite(shown).all()


def test_a_shifted_world_takes_the_held_toe_along() -> None:
    R, shift = rotation_y(0.7), np.array([1.0, 0.3, -2.0])
    T = np.eye(4)[None].copy()
    T[0, :3, :3], T[0, :3, 3] = R, shift
    a, b, c, d = np.random.default_rng(7).normal(size=(4, 1, 2, 3))
    lock = replace(locked(toes()), leg=a, leg_v=b, offset=c, offset_v=d)
    moved = lock.shifted(T)
    np.testing.assert_allclose(moved.p_lock, lock.p_lock @ R.T + shift)
    np.testing.assert_allclose(moved.toe, lock.toe @ R.T + shift)
    for was, now in (
        (a, moved.leg), (b, moved.leg_v), (c, moved.offset), (d, moved.offset_v)
    ):  # fmt: skip
        np.testing.assert_allclose(now, was @ R.T)
