"""Calibration.frame: tracker poses -> joint poses on the standard skeleton."""

import numpy as np
import pytest
from support.calibrations import calibrated
from support.motions import walking

from lobstr_hw.calibration import Calibration
from lobstr_hw.simulation import SimulatedTake, TrackingErrors, simulate
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT, TrackerRole


@pytest.fixture(scope="module")
def take() -> SimulatedTake:
    return simulate(walking(2.0), 9, errors=TrackingErrors.none())


@pytest.fixture(scope="module")
def true_calibration(take: SimulatedTake) -> Calibration:
    """What a perfect calibration would be."""
    inverse = [take.user.mounts[role].inverse() for role in FOUR_POINTS]
    return Calibration(
        {take.serials[role]: role for role in FOUR_POINTS},
        np.stack([T.R for T in inverse]),
        np.stack([T.p for T in inverse]),
        take.user.body,
        take.user.stature_m,
    )


def test_true_offsets_give_true_joints_scaled(
    take: SimulatedTake, true_calibration: Calibration
) -> None:
    valid = np.ones(take.tracked.shape, dtype=bool)
    frame = true_calibration.frame(0.5, FOUR_POINTS, take.p, take.R, valid, valid)
    joints = [ROLE_JOINT[role] for role in FOUR_POINTS]
    expected = take.truth_p[:, joints] * take.user.body.scale[0]
    np.testing.assert_allclose(frame.p[::2], expected, atol=1e-9)
    np.testing.assert_allclose(frame.R[::2], take.truth_R[:, joints], atol=1e-9)
    assert frame.time_s == 0.5


def test_roles_may_come_in_any_order(take: SimulatedTake, true_calibration: Calibration) -> None:
    order = [2, 0, 3, 1]
    roles = tuple(FOUR_POINTS[i] for i in order)
    valid = take.tracked
    a = true_calibration.frame(0.0, FOUR_POINTS, take.p, take.R, valid, valid)
    b = true_calibration.frame(
        0.0, roles, take.p[:, order], take.R[:, order], valid[:, order], valid[:, order]
    )
    np.testing.assert_array_equal(a.p[:, order], b.p)
    np.testing.assert_array_equal(a.R[:, order], b.R)


def test_a_role_that_was_not_calibrated_is_not_valid(true_calibration: Calibration) -> None:
    roles = (*FOUR_POINTS, TrackerRole.LEFT_FOOT)
    valid = np.ones((1, 5), dtype=bool)
    R = np.broadcast_to(np.eye(3), (1, 5, 3, 3))
    frame = true_calibration.frame(0.0, roles, np.zeros((1, 5, 3)), R, valid, valid)
    np.testing.assert_array_equal(frame.valid_p, [[True, True, True, True, False]])
    np.testing.assert_array_equal(frame.valid_R, [[True, True, True, True, False]])
    assert np.isfinite(frame.p).all()


def test_what_is_given_is_not_changed(take: SimulatedTake) -> None:
    calibration = calibrated(take)
    p, R = take.p.copy(), take.R.copy()
    calibration.frame(0.0, FOUR_POINTS, p, R, take.tracked, take.tracked)
    np.testing.assert_array_equal(p, take.p)
    np.testing.assert_array_equal(R, take.R)
