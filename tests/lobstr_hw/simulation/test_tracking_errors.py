"""Laws of the simulated tracking errors."""

from dataclasses import replace

import numpy as np
import pytest

from lobstr_hw.rotations import Array, geodesic_angle, rotation_y
from lobstr_hw.simulation import TrackingErrors
from lobstr_hw.simulation.tracking_errors import disturbed

NONE = TrackingErrors.none()
MINUTES = 20.0


@pytest.fixture(scope="module")
def still() -> tuple[Array, Array, Array]:
    """Four trackers that never move, for 20 minutes at 30 Hz."""
    times = np.arange(int(MINUTES * 60 * 30)) / 30.0
    p = np.zeros((len(times), 4, 3)) + np.arange(4)[:, None]
    return times, p, np.broadcast_to(rotation_y(0.3), (len(times), 4, 3, 3))


def seen(errors: TrackingErrors, still: tuple[Array, Array, Array], seed: int = 1) -> Array:
    """How far off (m, 4) the positions are."""
    times, p, R = still
    off: Array = np.linalg.norm(
        disturbed(errors, np.random.default_rng(seed), times, p, R)[0] - p, axis=-1
    )
    return off


def test_without_errors_all_is_as_it_was(still: tuple[Array, Array, Array]) -> None:
    times, p, R = still
    out_p, out_R, tracked = disturbed(NONE, np.random.default_rng(0), times, p, R)
    np.testing.assert_array_equal(out_p, p)
    np.testing.assert_array_equal(out_R, R)
    assert tracked.all()


def test_the_same_seed_disturbs_the_same_way(still: tuple[Array, Array, Array]) -> None:
    np.testing.assert_array_equal(
        seen(TrackingErrors(), still, 3), seen(TrackingErrors(), still, 3)
    )


def test_jitter_alone_is_sub_millimetre_and_has_its_size(
    still: tuple[Array, Array, Array],
) -> None:
    off = seen(replace(NONE, jitter_m=0.0003), still)
    assert np.sqrt(np.mean(off**2) / 3.0) == pytest.approx(0.0003, rel=0.02)
    assert np.max(off) < 0.003


def test_drift_alone_is_slow_and_has_its_size(still: tuple[Array, Array, Array]) -> None:
    times, p, R = still
    out = disturbed(replace(NONE, drift_m=0.002), np.random.default_rng(2), times, p, R)[0] - p
    assert np.std(out) == pytest.approx(0.002, rel=0.3)
    per_second = np.linalg.norm(out[30:] - out[:-30], axis=-1)
    assert np.max(per_second) < 0.01


def test_rotations_drift_and_jitter_by_their_sizes(still: tuple[Array, Array, Array]) -> None:
    times, p, R = still
    errors = replace(NONE, jitter_rad=0.001)
    angle = geodesic_angle(disturbed(errors, np.random.default_rng(4), times, p, R)[1], R)
    assert np.sqrt(np.mean(angle**2) / 3.0) == pytest.approx(0.001, rel=0.02)


def test_jumps_are_rare_short_and_said_to_be_tracked(still: tuple[Array, Array, Array]) -> None:
    times, p, R = still
    errors = replace(NONE, jumps_per_minute=0.5)
    out, _, tracked = disturbed(errors, np.random.default_rng(5), times, p, R)
    off = np.linalg.norm(out - p, axis=-1) > 0.0
    starts = np.sum(off[1:] & ~off[:-1])
    assert tracked.all()
    assert 10 < starts < 80  # 40 expected
    assert np.mean(off) < 0.003


def test_dropouts_say_so_and_hold_what_does_not_move(still: tuple[Array, Array, Array]) -> None:
    times, p, R = still
    errors = replace(NONE, dropouts_per_minute=0.5)
    out, _, tracked = disturbed(errors, np.random.default_rng(6), times, p, R)
    np.testing.assert_allclose(out, p, atol=1e-12)
    assert 0.001 < np.mean(~tracked) < 0.02


def test_a_blind_tracker_coasts_on_and_then_holds() -> None:
    times = np.arange(900) / 90.0
    p = np.zeros((900, 1, 3))
    p[:, 0, 0] = times  # one metre per second
    R = np.broadcast_to(np.eye(3), (900, 1, 3, 3))
    errors = replace(NONE, dropouts_per_minute=30.0, coast_s=0.1)
    out, _, tracked = disturbed(errors, np.random.default_rng(0), times, p, R)
    assert not tracked.all()
    lost = np.flatnonzero(~tracked[:, 0])
    runs = np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1)
    for run in runs:
        travelled = out[run, 0, 0] - out[run[0] - 1, 0, 0]
        assert np.all(np.diff(travelled) >= -1e-12)
        assert travelled[-1] <= 0.1  # it slows down, so it gets half as far at most
        late = times[run] - times[run[0] - 1] > 0.1
        assert np.ptp(out[run[late], 0, 0]) < 1e-12 if late.any() else True
