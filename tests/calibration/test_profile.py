"""The profile: there and back, whole or not at all, and faults told by their key."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.calibrations import calibrated
from support.motions import walking

from lobstr_hw.calibration import Calibration, load_profile, save_profile
from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.calibration.profile import profile_from_json, profile_to_json
from lobstr_hw.errors import ProfileError
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import rotation_y
from lobstr_hw.simulation import simulate


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return calibrated(simulate(walking(1.0), 4))


def test_what_is_saved_is_loaded(calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "new folder" / "profile.json"
    save_profile(path, calibration)
    loaded = load_profile(path)
    assert dict(loaded.roles) == dict(calibration.roles)
    np.testing.assert_allclose(loaded.R_tracker_joint, calibration.R_tracker_joint, atol=1e-14)
    np.testing.assert_array_equal(loaded.p_tracker_joint, calibration.p_tracker_joint)
    np.testing.assert_array_equal(loaded.body.offsets, calibration.body.offsets)
    np.testing.assert_array_equal(loaded.body.sole, calibration.body.sole)
    np.testing.assert_allclose(loaded.body.scale, calibration.body.scale, rtol=1e-15)
    assert loaded.residuals == calibration.residuals
    assert loaded.heading_rad == calibration.heading_rad
    assert loaded.stature_m == calibration.stature_m
    assert loaded.created == calibration.created


def test_loading_and_saving_again_changes_nothing(calibration: Calibration) -> None:
    once = profile_from_json(profile_to_json(calibration))
    twice = profile_from_json(profile_to_json(once))
    np.testing.assert_allclose(once.R_tracker_joint, twice.R_tracker_joint, atol=1e-15)
    assert once.residuals == twice.residuals


def test_tracking_spaces_are_kept_by_name(calibration: Calibration, tmp_path: Path) -> None:
    T = Pose(rotation_y(0.7), np.array([1.0, 0.2, -3.0]))
    spaces = {"openvr": TrackingSpace(), "belt": TrackingSpace(T, -0.004, 0.003, 0.01)}
    save_profile(tmp_path / "p.json", replace(calibration, tracking_spaces=spaces))
    loaded = load_profile(tmp_path / "p.json").tracking_spaces
    assert list(loaded) == ["openvr", "belt"]
    np.testing.assert_allclose(loaded["belt"].T_world_space.R, T.R, atol=1e-15)
    np.testing.assert_array_equal(loaded["belt"].T_world_space.p, T.p)
    assert loaded["belt"].delay_s == -0.004
    assert (loaded["belt"].residual_m, loaded["belt"].residual_rad) == (0.003, 0.01)
    np.testing.assert_array_equal(loaded["openvr"].T_world_space.p, np.zeros(3))


def test_saving_leaves_no_other_file(calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "profile.json"
    save_profile(path, calibration)
    save_profile(path, calibration)
    assert [p.name for p in tmp_path.iterdir()] == ["profile.json"]


def test_a_profile_that_cannot_be_written_leaves_the_old_one(
    calibration: Calibration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "profile.json"
    save_profile(path, calibration)
    before = path.read_bytes()

    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full_disk)
    with pytest.raises(ProfileError, match="No space left"):
        save_profile(path, calibration)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["profile.json"]


def test_a_missing_profile_is_told_with_the_command_that_makes_one(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match=r"nobody\.json: no such profile.*lobstr-calibrate"):
        load_profile(tmp_path / "nobody.json")


@pytest.mark.parametrize("text", ["", "{", "[1]", "null"])
def test_what_is_no_profile_is_refused(text: str) -> None:
    with pytest.raises(ProfileError, match="lobstr-calibrate"):
        profile_from_json(text, "x.json")


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("format",), 2, "format is 2"),
        (("stature_m",), "tall", "stature_m should be a finite number"),
        (("stature_m",), True, "stature_m should be a finite number"),
        (("hips_height_m",), -1.0, "hips_height_m should be above 0"),
        (("floor_height_m",), float("nan"), "floor_height_m should be a finite number"),
        (("trackers",), {}, "trackers has no tracker"),
        (("trackers",), [], "trackers should be an object"),
        (("body", "offsets_m", "Spine"), [1.0, 2.0], r"body\.offsets_m\.Spine should be 3"),
        (("body", "offsets_m", "Spine"), "up", r"body\.offsets_m\.Spine should be 3"),
        (("residuals", "misfit"), None, r"residuals\.misfit should be"),
    ],
)
def test_a_wrong_value_is_told_by_its_key(
    calibration: Calibration, keys: tuple[str, ...], value: Any, message: str
) -> None:
    document = json.loads(profile_to_json(calibration))
    inner = document
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value
    with pytest.raises(ProfileError, match=message):
        profile_from_json(json.dumps(document), "x.json")


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("role", "tail", "is 'tail', not one of head"),
        ("joint_in_tracker_quat_xyzw", [0, 0, 0, 0], "is no rotation"),
        ("joint_in_tracker_m", [0, 0, None], "should be 3 finite numbers"),
        ("role", "left_hand", "name one role twice"),
    ],
)
def test_a_wrong_tracker_is_told_by_its_key(
    calibration: Calibration, key: str, value: Any, message: str
) -> None:
    document = json.loads(profile_to_json(calibration))
    document["trackers"][next(iter(calibration.roles))][key] = value
    with pytest.raises(ProfileError, match=message):
        profile_from_json(json.dumps(document), "x.json")


def test_every_key_is_needed(calibration: Calibration) -> None:
    document = json.loads(profile_to_json(calibration))
    for key in document:
        rest = {k: v for k, v in document.items() if k != key}
        with pytest.raises(ProfileError, match=f"x.json: {key}"):
            profile_from_json(json.dumps(rest), "x.json")
