"""The fake person can be calibrated and does not change from run to run."""

import numpy as np
import pytest

from lobstr_hw.drivers.fake import MOUNTS, OTHER_SPACE, SERIALS, T_POSE_S, FakeDriver
from lobstr_hw.rotations import Array, rotation_y
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint
from lobstr_hw.trackers import TrackerRole


def positions(driver: FakeDriver, role: TrackerRole, end_s: float) -> Array:
    with driver:
        samples = driver.poll(end_s)
    return np.array([s.T_world_tracker.p for s in samples if s.serial == SERIALS[role]])


def test_the_same_seed_is_the_same_person_and_another_jitters_otherwise() -> None:
    a, b, c = (positions(FakeDriver(seed), TrackerRole.HEAD, 1.0) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert 0.0 < np.abs(a - c).max() < 0.002


def test_it_holds_a_t_pose_and_then_lowers_the_arms() -> None:
    hands = {r: positions(FakeDriver(), r, 8.0) for r in SERIALS if "hand" in r}
    span = np.linalg.norm(hands[TrackerRole.LEFT_HAND] - hands[TrackerRole.RIGHT_HAND], axis=-1)
    held = round(T_POSE_S * 90.0)
    assert np.ptp(span[:held]) < 0.002
    assert span[:held].mean() > 1.4
    assert span[-1] < 0.75
    assert np.all(np.abs(np.diff(span)) < 0.05), "nothing jumps"


@pytest.mark.parametrize("height_cm", [150.0, 170.6, 195.0])
def test_devices_sit_where_their_mounts_say(height_cm: float) -> None:
    size = height_cm / 170.6
    p = positions(FakeDriver(height_cm=height_cm), TrackerRole.PELVIS, 1.0)
    hips = STANDARD_OFFSETS[Joint.HIPS] + MOUNTS[TrackerRole.PELVIS]
    np.testing.assert_allclose(p.mean(axis=0), hips * size, atol=1e-4)


def test_devices_face_backwards_as_openvr_has_it() -> None:
    with FakeDriver() as driver:
        head = driver.poll(0.0)[0]
    np.testing.assert_allclose(head.T_world_tracker.R, rotation_y(np.pi), atol=1e-9)


@pytest.mark.parametrize("wrong", [{"rate_hz": 0.0}, {"height_cm": -1.0}])
def test_impossible_people_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        FakeDriver(**wrong)  # type: ignore[arg-type]


def test_some_of_the_devices_in_a_space_of_their_own() -> None:
    with FakeDriver() as whole, FakeDriver(has="pelvis", apart=1) as belt:
        there = [s for s in whole.poll(1.0) if s.serial == SERIALS[TrackerRole.PELVIS]]
        apart = belt.poll(1.0)
        assert [d.serial for d in belt.devices()] == [SERIALS[TrackerRole.PELVIS]]
    assert len(apart) == len(there) > 0
    for a, b in zip(apart, there, strict=True):
        assert a.T_world_tracker.p is not None and b.T_world_tracker.p is not None
        back = OTHER_SPACE.inverse().apply(a.T_world_tracker.p)
        np.testing.assert_allclose(back, b.T_world_tracker.p, atol=2e-3)


def test_a_device_that_is_no_role_is_told() -> None:
    with pytest.raises(ValueError, match=r"'tail' is not one of head"):
        FakeDriver(has="head+tail")
