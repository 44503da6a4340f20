"""A whole session obeys its user: the loop, the fake person and their buttons."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from lobstr_hw.calibration import Calibration, calibrate_t_pose, load_profile, save_profile
from lobstr_hw.calibration.t_pose import TPoseDetector
from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind
from lobstr_hw.drivers.fake import SERIALS, FakeDriver
from lobstr_hw.errors import ProfileError
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import heading_angle, rotation_y
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.skeleton import PARENTS, Body
from lobstr_hw.skeleton_pose import Mode, SkeletonPose
from lobstr_hw.trackers import TrackerRole, TrackerSample

LEFT, RIGHT, PELVIS = TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND, TrackerRole.PELVIS


class Person(FakeDriver):
    """The fake person, with buttons at given times and a belt that slips round."""

    def __init__(
        self,
        presses: Sequence[tuple[float, float, TrackerRole, str]] = (),
        commands: Sequence[tuple[float, str]] = (),
        slips_at_s: float = float("inf"),
        battery: float = 1.0,
        script: str = "",
    ) -> None:
        super().__init__(battery=battery, script=script)
        down = [(a, EventKind.BUTTON_DOWN, SERIALS[r], name) for a, _, r, name in presses]
        up = [(b, EventKind.BUTTON_UP, SERIALS[r], name) for _, b, r, name in presses]
        told = [(at, EventKind.COMMAND, "", name) for at, name in commands]
        self._left = sorted([*down, *up, *told], key=lambda event: event[0])
        self._slips_at_s = slips_at_s

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        return [self._slipped(sample) for sample in super().poll(now_s)]

    def _slipped(self, sample: TrackerSample) -> TrackerSample:
        if sample.serial != SERIALS[PELVIS] or sample.time_s < self._slips_at_s:
            return sample
        # round the body on its belt: the pose of the joint's own frame turned
        pose = sample.T_world_tracker
        R = rotation_y(np.radians(25.0)) @ pose.R
        return TrackerSample(sample.serial, PartialPose(R, pose.p), sample.time_s, True)

    def events(self) -> Sequence[DeviceEvent]:
        due = [e for e in self._left if e[0] <= self._now_s]
        self._left = self._left[len(due) :]
        return [DeviceEvent(kind, serial, at, name) for at, kind, serial, name in due]


class Capture:
    """An output that remembers the poses."""

    def __init__(self) -> None:
        self.poses: list[SkeletonPose] = []

    def open(self, body: Body, rate_hz: float, take: str) -> None: ...

    def calibrated(self, body: Body) -> None: ...

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        self.poses.append(pose)

    def close(self) -> None: ...


def both(button: str, start_s: float) -> list[tuple[float, float, TrackerRole, str]]:
    return [(start_s, start_s + 2.0, hand, button) for hand in (LEFT, RIGHT)]


def played(
    driver: FakeDriver, seconds: float, profile: Path | None = None
) -> tuple[LiveSession, list[SkeletonPose], list[Spoken]]:
    said: list[Spoken] = []
    capture = Capture()
    options = LiveOptions(
        predictor="standing", fast=True, quiet=True, duration_s=seconds, profile=profile
    )
    with LiveSession(driver, options, lambda _: None, say=said.append) as live:
        live.outputs.append(capture)
        live.run(lambda: False)
    return live, capture.poses, said


def a_profile() -> Calibration:
    detector = TPoseDetector({serial: role for role, serial in SERIALS.items()})
    with FakeDriver() as driver:
        pose = detector.add(driver.poll(4.0))
    assert pose is not None
    return calibrate_t_pose(pose)


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    path = tmp_path / "me.json"
    save_profile(path, a_profile())
    return path


def words(said: list[Spoken]) -> list[str]:
    return [spoken.text for spoken in said]


def hips_against_head_deg(pose: SkeletonPose) -> float:
    return float(np.rad2deg(heading_angle(pose.R_local[0, 0])[0]))


def assert_smooth(poses: list[SkeletonPose]) -> None:
    p = np.stack([pose.p_world[0] for pose in poses])
    speed = np.linalg.norm(np.diff(p, axis=0), axis=-1) * 45.0
    assert speed.max() < 5.0, "nothing jumps"


def test_the_first_calibration_is_told() -> None:
    _, _, said = played(Person(), 3.0)
    assert words(said) == ["Calibrated."]


def test_both_triggers_turn_a_slipped_belt_back_smoothly(profile: Path) -> None:
    driver = Person(both("trigger", 5.0), slips_at_s=3.5)
    live, poses, said = played(driver, 9.0, profile)
    assert any("Heading corrected" in text for text in words(said))
    wrong, right = (abs(hips_against_head_deg(poses[round(45 * t)])) for t in (4.8, 8.5))
    assert wrong > 20.0
    assert right < 5.0
    assert_smooth(poses[round(4.8 * 45) :])
    assert live.session.body is not None
    np.testing.assert_array_equal(live.session.body.offsets, load_profile(profile).body.offsets)


def test_both_grips_freeze_and_go_on_without_a_jump(profile: Path) -> None:
    driver = Person([*both("grip", 1.0), *both("grip", 5.5)])
    _, poses, said = played(driver, 9.0, profile)
    assert words(said)[-2:] == ["Frozen.", "Going on."]
    held = np.stack([pose.p_world for pose in poses[round(2.7 * 45) : round(6.9 * 45)]])
    assert np.ptp(held, axis=0).max() == 0.0, "the arms went down meanwhile"
    assert [pose.time_s for pose in poses] == [k / 45.0 for k in range(len(poses))]
    assert_smooth(poses)


def test_menu_sits_down_and_stands_up(profile: Path) -> None:
    driver = Person([(1.0, 3.0, RIGHT, "menu"), (5.0, 7.0, LEFT, "menu")])
    live, poses, said = played(driver, 9.0, profile)
    assert words(said)[-2:] == ["Seated.", "Standing."]
    assert poses[round(4.0 * 45)].mode is Mode.SEATED
    assert poses[-1].mode is Mode.STANDING
    assert_smooth(poses)
    lengths = np.linalg.norm(live.session.body.offsets[0, 1:], axis=-1)
    for pose in poses:
        bones = np.linalg.norm(pose.p_world[0, 1:] - pose.p_world[0, PARENTS[1:]], axis=-1)
        np.testing.assert_allclose(bones, lengths, atol=1e-9)


@pytest.mark.parametrize(("hand", "centimetres"), [(RIGHT, 2.0), (LEFT, -2.0)])
def test_one_press_moves_the_body_by_two_centimetres(
    profile: Path, hand: TrackerRole, centimetres: float
) -> None:
    nudge = [(1.0, 2.4, hand, "grip"), (2.0, 2.2, hand, "menu")]
    _, still, _ = played(Person(), 3.6, profile)
    live, moved, _ = played(Person(nudge), 3.6, profile)
    rise = moved[-1].p_world[0, 0] - still[-1].p_world[0, 0]
    np.testing.assert_allclose(rise, [0.0, centimetres / 100.0, 0.0], atol=1e-6)
    assert live.session.calibration is not None
    assert live.session.calibration.floor_m == pytest.approx(-centimetres / 100.0)


def test_another_program_asks_for_a_t_pose_and_the_body_stays(profile: Path) -> None:
    driver = Person(commands=[(0.5, "calibrate_ready"), (1.0, "calibrate")])
    live, _, said = played(driver, 4.0, profile)
    assert words(said)[-3:] == ["Get ready for a T pose.", "Hold a T pose.", "Calibrated."]
    np.testing.assert_array_equal(live.session.body.offsets, load_profile(profile).body.offsets)


def test_a_t_pose_that_does_not_come_leaves_all_as_it_was(profile: Path) -> None:
    driver = Person(commands=[(6.0, "calibrate")])
    live, _, said = played(driver, 37.0, profile)
    assert said[-1].sound is Sound.TROUBLE
    assert live.session.calibration is not None
    np.testing.assert_array_equal(
        live.session.calibration.p_tracker_joint, load_profile(profile).p_tracker_joint
    )


def test_before_the_calibration_commands_are_answered_and_not_obeyed() -> None:
    driver = Person(commands=[(0.2, "freeze"), (0.3, "seat")])
    _, poses, said = played(driver, 3.0)
    assert words(said) == ["Not calibrated yet: hold a T pose."] * 2 + ["Calibrated."]
    assert not any(pose.mode is Mode.SEATED for pose in poses)


def test_a_low_battery_is_told(profile: Path) -> None:
    _, _, said = played(Person(battery=0.1), 2.0, profile)
    assert sum("Battery of" in text for text in words(said)) == 4


def test_a_profile_that_fits_raises_no_warning(profile: Path) -> None:
    _, _, said = played(Person(), 3.5, profile)
    assert not said


def test_a_profile_of_a_taller_person_is_noticed_within_seconds(profile: Path) -> None:
    _, _, said = played(FakeDriver(height_cm=155.0), 3.5, profile)
    assert [spoken.sound for spoken in said] == [Sound.TROUBLE]
    assert "lobstr-calibrate" in said[0].text


def test_a_profile_of_other_devices_is_refused(tmp_path: Path, profile: Path) -> None:
    class Others(FakeDriver):
        def devices(self) -> Sequence[DeviceInfo]:
            return [DeviceInfo("OTHER", "headset")]

    with pytest.raises(ProfileError, match="lobstr-calibrate"):
        played(Others(), 1.0, profile)
