"""Which profile a session begins with, and what is said about it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.calibrations import calibrated
from support.list_driver import ListDriver

from lobstr_hw.calibration import Calibration, TrackingSpace, save_profile
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.errors import ProfileError
from lobstr_hw.poses import PartialPose
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.runtime.profile_path import default_profile_path
from lobstr_hw.runtime.profiles import chosen_profile, spaces_as_before
from lobstr_hw.simulation import SimulatedTake
from lobstr_hw.trackers import TrackerRole, TrackerSample

MIXED = {"openvr": TrackingSpace(), "polhemus": TrackingSpace(delay_s=0.01)}


@pytest.fixture(scope="module")
def profile(take: SimulatedTake) -> Calibration:
    return calibrated(take)


@pytest.fixture
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("platformdirs.user_config_path", lambda *a, **k: tmp_path)
    default_profile_path().parent.mkdir(parents=True, exist_ok=True)
    return tmp_path


def devices(profile: Calibration) -> dict[str, TrackerRole | None]:
    return dict(profile.roles)


def chosen(
    path: Path | None, hints: Mapping[str, TrackerRole | None]
) -> tuple[Calibration | None, list[str]]:
    told: list[str] = []
    return chosen_profile(path, ListDriver([], hints), told.append), told


def test_a_profile_of_two_systems_needs_both(profile: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "mixed.json"
    save_profile(path, replace(profile, tracking_spaces=MIXED))
    pelvis = profile.serial_of(TrackerRole.PELVIS)
    hints = {s: r for s, r in devices(profile).items() if s != pelvis}
    with pytest.raises(ProfileError) as caught:
        chosen(path, hints)
    message = str(caught.value)
    assert "joins the tracking systems openvr and polhemus" in message
    assert "all of them with --driver, as at the calibration" in message
    assert "lobstr-calibrate" in message


def test_a_driver_that_names_no_devices_yet_is_told_of_the_others(
    profile: Calibration, tmp_path: Path
) -> None:
    path = tmp_path / "mixed.json"
    save_profile(path, replace(profile, tracking_spaces=MIXED))
    found, told = chosen(path, {})
    assert found is not None
    assert len(told) == 1
    assert "one alone is here" in told[0]


def test_all_of_its_devices_in_one_system_are_enough(profile: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "mixed.json"
    save_profile(path, replace(profile, tracking_spaces=MIXED))
    found, told = chosen(path, devices(profile))
    assert found is not None
    assert told == []
    parts = [PartDriver(ListDriver([], devices(profile)), "openvr")]
    assert chosen_profile(path, ManyDrivers(parts), told.append) is not None


def test_a_role_given_on_the_command_line_goes_before_nothing_in_silence(
    profile: Calibration, tmp_path: Path
) -> None:
    path = tmp_path / "me.json"
    save_profile(path, profile)
    driver = PartDriver(ListDriver([], devices(profile)), "vr", TrackerRole.CHEST)
    with pytest.raises(ProfileError, match=r"says now that it is the chest.*role= of --driver"):
        chosen_profile(path, ManyDrivers([driver]), print)


def test_the_users_own_profile_that_does_not_fit_is_told_and_not_used(
    profile: Calibration, own_folder: Path
) -> None:
    save_profile(default_profile_path(), profile)
    swapped = devices(profile)
    left, right = (profile.serial_of(r) for r in (TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND))
    assert left is not None and right is not None
    swapped[left], swapped[right] = swapped[right], swapped[left]
    found, told = chosen(None, swapped)
    assert found is None
    assert "is not used" in told[0]
    assert "T-pose" in told[0]
    found, told = chosen(None, devices(profile))
    assert found is not None
    assert told == [f"calibrated by {default_profile_path()}"]


def test_old_spaces_are_kept_only_for_the_same_world(profile: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "mixed.json"
    assert spaces_as_before(path, "openvr") == {}
    save_profile(path, replace(profile, tracking_spaces=MIXED))
    assert set(spaces_as_before(path, "openvr")) == set(MIXED)
    assert spaces_as_before(path, "polhemus") == {}
    assert spaces_as_before(path, "vmc") == {}
    path.write_text("broken", encoding="utf-8")
    assert spaces_as_before(path, "openvr") == {}


def test_a_profile_in_a_log_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    with TrackerLogWriter(path) as writer:
        writer.attach_profile(b"\xff\xfe")
        writer.add_sample(TrackerSample("A", PartialPose(np.eye(3), np.zeros(3)), 0.0, True))
    with ReplayDriver(path) as driver:
        with pytest.raises(ProfileError, match="--profile FILE"):
            chosen_profile(None, driver, lambda _: None)
        assert spaces_as_before(driver, "openvr") == {}
