"""Changes of a calibration in use: what they do, and what they leave alone."""

from dataclasses import replace

import numpy as np
import pytest
from support.calibrations import calibrated
from support.made_logs import made_take

from lobstr_hw.calibration import Calibration
from lobstr_hw.calibration.adjust import between, with_floor, with_heading, with_offsets_of
from lobstr_hw.errors import CalibrationError
from lobstr_hw.rotations import Array, geodesic_angle, heading_angle, rotation_x, rotation_y
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

Rotations = dict[TrackerRole, Array]
HEAD, PELVIS = TrackerRole.HEAD, TrackerRole.PELVIS


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return calibrated(made_take())


def trackers(calibration: Calibration, joints: Rotations) -> Rotations:
    """Where trackers are when the joints are so."""
    serials = {role: serial for serial, role in calibration.roles.items()}
    return {role: R @ calibration.T_tracker_joint(serials[role]).R.T for role, R in joints.items()}


def joint(calibration: Calibration, role: TrackerRole, R_tracker: Array) -> Array:
    serial = calibration.serial_of(role)
    assert serial is not None
    return np.asarray(R_tracker @ calibration.T_tracker_joint(serial).R)


@pytest.mark.parametrize("slipped_deg", [-80.0, -5.0, 0.0, 12.0, 60.0])
@pytest.mark.parametrize("facing_deg", [0.0, 170.0])
def test_a_belt_that_slipped_round_faces_where_the_head_does(
    calibration: Calibration, slipped_deg: float, facing_deg: float
) -> None:
    facing, slip = rotation_y(np.radians(facing_deg)), rotation_y(np.radians(slipped_deg))
    tilt = rotation_x(np.radians(8.0))
    now = trackers(calibration, {HEAD: facing, PELVIS: facing @ slip @ tilt})
    after = with_heading(calibration, now)
    R = joint(after, PELVIS, now[PELVIS])
    assert heading_angle(facing.T @ R)[0] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(R[1], (slip @ tilt)[1], atol=1e-9, err_msg="its tilt is kept")
    np.testing.assert_allclose(joint(after, HEAD, now[HEAD]), facing, atol=1e-9)


def test_a_heading_correction_leaves_all_else_alone(calibration: Calibration) -> None:
    now = trackers(calibration, {HEAD: np.eye(3), PELVIS: rotation_y(0.3)})
    after = with_heading(calibration, now)
    np.testing.assert_array_equal(after.p_tracker_joint, calibration.p_tracker_joint)
    assert after.body is calibration.body
    assert after.floor_m == calibration.floor_m
    changed = geodesic_angle(after.R_tracker_joint, calibration.R_tracker_joint) > 1e-9
    assert [role for role, c in zip(after.roles.values(), changed, strict=True) if c] == [PELVIS]


def test_twice_is_once(calibration: Calibration) -> None:
    now = trackers(calibration, {HEAD: np.eye(3), PELVIS: rotation_y(-0.7)})
    once = with_heading(calibration, now)
    twice = with_heading(once, now)
    np.testing.assert_allclose(twice.R_tracker_joint, once.R_tracker_joint, atol=1e-12)


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        ({HEAD: np.eye(3), PELVIS: rotation_y(2.0)}, "look straight ahead"),
        ({HEAD: rotation_x(np.pi) @ rotation_y(0.1), PELVIS: np.eye(3)}, "stand upright"),
        ({HEAD: np.eye(3)}, "pelvis"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_what_to_do(
    calibration: Calibration, joints: dict[TrackerRole, Array], words: str
) -> None:
    with pytest.raises(CalibrationError, match=words):
        with_heading(calibration, trackers(calibration, joints))


def test_up_and_down_cancel_and_up_is_up(calibration: Calibration) -> None:
    up = with_floor(calibration, 0.02)
    p, R = np.ones((1, 4, 3)), np.tile(np.eye(3), (1, 4, 1, 1))
    there = np.ones((1, 4), dtype=bool)
    before, after = (c.frame(0.0, FOUR_POINTS, p, R, there, there).p for c in (calibration, up))
    np.testing.assert_allclose((after - before)[..., 1], 0.02 * calibration.scale)
    assert with_floor(up, -0.02).floor_m == pytest.approx(calibration.floor_m)


def test_the_way_between_two_begins_and_ends_there(calibration: Calibration) -> None:
    new = with_heading(
        with_floor(calibration, 0.1),
        trackers(calibration, {HEAD: np.eye(3), PELVIS: rotation_y(0.5)}),
    )
    first, middle, last = (between(calibration, new, share) for share in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(first.R_tracker_joint, calibration.R_tracker_joint, atol=1e-9)
    assert last is new
    way = geodesic_angle(calibration.R_tracker_joint, middle.R_tracker_joint)
    np.testing.assert_allclose(
        way, 0.5 * geodesic_angle(calibration.R_tracker_joint, new.R_tracker_joint), atol=1e-6
    )


def test_exchanged_trackers_are_not_met_half_way(calibration: Calibration) -> None:
    serials = list(calibration.roles)
    roles = dict(zip(serials[::-1], calibration.roles.values(), strict=True))
    other = replace(calibration, roles=roles)
    assert between(calibration, other, 0.1) is other


def test_a_later_calibration_keeps_the_body(calibration: Calibration) -> None:
    later = calibrated(made_take(seed=9))
    kept = with_offsets_of(calibration, later)
    assert kept.body is calibration.body
    assert kept.roles == later.roles
