"""The openxr driver on a fake runtime, through the real package and Khronos' loader."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.driver_contract import DriverContract, Make
from support.openxr_bed import (
    BUTTONS,
    HEAD,
    IN_SIGHT,
    LEFT,
    PLACE_VALID,
    RIGHT,
    ROTATION_TRACKED,
    ROTATION_VALID,
    TRACKER_ROLE,
    OpenXR,
    build_runtime,
    running_openxr,
)

from lobstr_hw.drivers import load_driver
from lobstr_hw.drivers.driver import DeviceInfo, EventKind, TrackerDriver
from lobstr_hw.drivers.openxr import driver as driver_module
from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound
from lobstr_hw.rotations import from_rotation_vector
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

pytestmark = pytest.mark.bed

HEAD_AT, LEFT_AT, RIGHT_AT, WAIST_AT, OTHER_AT = range(5)
WAIST = "LHR-WAIST001"
SERIALS = ["OPENXR-HEAD", "OPENXR-LEFT-HAND", "OPENXR-RIGHT-HAND", WAIST]
PERSISTENT = f"/devices/htc/vive_tracker{WAIST}"

STATE_CHANGED, SPACE_CHANGING, INSTANCE_LOST, TRACKER_CONNECTED = 18, 40, 17, 1000103001
VISIBLE, FOCUSED, STOPPING, LOSS_PENDING = 4, 5, 6, 7
LOCAL, STAGE = 2, 3
WITHOUT_HEADLESS, WITHOUT_VIVE, WITHOUT_XDEV, WITHOUT_STAGE = 1, 4, 8, 16


@pytest.fixture(scope="session")
def manifest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_runtime(tmp_path_factory.mktemp("openxr"))


@pytest.fixture
def empty_openxr(manifest: Path, tmp_path: Path) -> Iterator[OpenXR]:
    with running_openxr(manifest, tmp_path / "stage") as openxr:
        yield openxr


@pytest.fixture
def openxr(empty_openxr: OpenXR) -> OpenXR:
    empty_openxr.add(HEAD_AT, HEAD)
    empty_openxr.add(LEFT_AT, LEFT)
    empty_openxr.add(RIGHT_AT, RIGHT)
    empty_openxr.add(WAIST_AT, f"{TRACKER_ROLE}waist", PERSISTENT)
    return empty_openxr


@pytest.fixture
def driver(openxr: OpenXR) -> Iterator[TrackerDriver]:
    with load_driver("openxr") as driver:
        yield driver


def by_serial(samples: object) -> dict[str, TrackerSample]:
    assert isinstance(samples, list)
    return {sample.serial: sample for sample in samples}


def info_of(driver: TrackerDriver, serial: str) -> DeviceInfo:
    return next(device for device in driver.devices() if device.serial == serial)


class TestOpenXRContract(DriverContract):
    @pytest.fixture
    def make(self, openxr: OpenXR) -> Make:
        return lambda: load_driver("openxr")


class TestSession:
    def test_every_session_that_began_ends(self, openxr: OpenXR) -> None:
        for _ in range(3):
            with load_driver("openxr") as driver:
                driver.poll(1.0)
        stage = openxr.stage
        assert (stage.instances, stage.sessions, stage.begun, stage.destroyed) == (3, 3, 3, 3)

    def test_making_and_probing_begin_nothing(self, openxr: OpenXR) -> None:
        assert type(load_driver("openxr")).probe().available
        assert openxr.stage.instances == 0

    def test_devices_are_listed_before_the_first_poll(self, driver: TrackerDriver) -> None:
        assert {device.serial for device in driver.devices()} == set(SERIALS)

    def test_a_controller_that_the_runtime_does_not_know_does_no_harm(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        known = 5  # all but one of ours, and the trackers'
        assert openxr.stage.profiles_suggested == known
        assert openxr.stage.bindings_suggested > known

    def test_poses_are_of_the_floor(self, driver: TrackerDriver, openxr: OpenXR) -> None:
        driver.poll(1.0)
        assert openxr.stage.base_space == STAGE

    def test_without_a_floor_it_takes_the_start_of_the_headset(self, openxr: OpenXR) -> None:
        openxr.stage.without = WITHOUT_STAGE
        with load_driver("openxr") as driver:
            assert len(driver.poll(1.0)) == 4
            assert openxr.stage.base_space == LOCAL


class TestTime:
    def test_a_pose_is_asked_for_at_the_time_of_the_poll(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        asked = []
        for now_s in (1.0, 1.0001, 1.0002):
            driver.poll(now_s)
            asked.append(openxr.stage.last_time_ns)
        assert np.all(np.diff(asked) <= 100_000 + 1)  # never further than the poll went on
        assert np.all(np.diff(asked) >= 0)

    def test_no_pose_of_the_future_is_asked_for(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        for now_s in np.arange(1.0, 3.0, 0.1):  # faster than real time
            driver.poll(now_s)
            assert openxr.stage.last_time_ns <= time.perf_counter_ns()

    def test_the_runtimes_zero_does_not_matter(self, openxr: OpenXR) -> None:
        openxr.stage.clock_offset_ns = 10**15
        with load_driver("openxr") as driver:
            sample = driver.poll(1.0)[0]
        assert sample.time_s == 1.0
        host_ns = time.perf_counter_ns()
        assert abs(openxr.stage.last_time_ns - 10**15 - host_ns) < 10**9


class TestPoses:
    def test_a_pose_arrives_as_the_runtime_has_it(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        rng = np.random.default_rng(5)
        for now_s in np.arange(1.0, 2.0, 0.1):
            p, R = rng.normal(size=(4, 3)), from_rotation_vector(rng.normal(size=(4, 3)))
            for index in range(4):
                openxr.move(index, R[index], p[index])
                openxr.stage.places[index].velocity[:] = p[index][::-1].tolist()
                openxr.stage.places[index].has_velocity = 1
            given = by_serial(driver.poll(now_s))
            for index in range(4):
                sample = given[SERIALS[index]]
                assert (sample.tracked, sample.state) == (True, TrackingState.OK)
                assert sample.time_s == now_s
                assert sample.T_world_tracker.p is not None
                np.testing.assert_allclose(sample.T_world_tracker.p, p[index], atol=1e-6)
                np.testing.assert_allclose(sample.T_world_tracker.R, R[index], atol=1e-5)
                assert sample.velocity is not None
                np.testing.assert_allclose(sample.velocity, p[index][::-1], atol=1e-6)

    def test_a_velocity_that_is_not_known_is_none(self, driver: TrackerDriver) -> None:
        assert by_serial(driver.poll(1.0))[WAIST].velocity is None

    @pytest.mark.parametrize(
        ("flags", "state", "has_place"),
        [
            (0, TrackingState.OCCLUDED, True),
            (PLACE_VALID, TrackingState.OCCLUDED, True),
            (ROTATION_VALID | ROTATION_TRACKED, TrackingState.INERTIAL, False),
            (ROTATION_VALID | PLACE_VALID, TrackingState.OUT_OF_RANGE, True),
            (ROTATION_VALID | PLACE_VALID | ROTATION_TRACKED, TrackingState.OUT_OF_RANGE, True),
        ],
    )
    def test_only_what_is_tracked_in_full_counts(
        self,
        driver: TrackerDriver,
        openxr: OpenXR,
        flags: int,
        state: TrackingState,
        has_place: bool,
    ) -> None:
        driver.poll(1.0)
        openxr.stage.places[WAIST_AT].has_velocity = 1
        openxr.stage.places[WAIST_AT].flags = flags
        sample = by_serial(driver.poll(1.1))[WAIST]
        assert (sample.tracked, sample.state) == (False, state)
        assert (sample.T_world_tracker.p is not None) == has_place
        assert sample.velocity is None

    def test_what_is_out_of_sight_is_held_where_it_was_last_tracked(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        openxr.move(WAIST_AT, np.eye(3), np.array([1.0, 2.0, 3.0]))
        driver.poll(1.0)
        openxr.move(WAIST_AT, np.eye(3), np.array([9.0, 9.0, 9.0]))
        openxr.stage.places[WAIST_AT].flags = ROTATION_VALID | PLACE_VALID  # a guess
        driver.poll(1.1)
        openxr.stage.places[WAIST_AT].flags = 0
        pose = by_serial(driver.poll(1.2))[WAIST].T_world_tracker
        assert pose.p is not None
        assert pose.p.tolist() == [1.0, 2.0, 3.0]


class TestComingAndGoing:
    def test_a_pulled_plug_is_told_once_and_a_return_too(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        driver.poll(1.0)
        openxr.stage.places[WAIST_AT].connected = 0
        last = by_serial(driver.poll(1.1))[WAIST]
        assert (last.tracked, last.state) == (False, TrackingState.GONE)
        assert WAIST not in by_serial(driver.poll(1.2))
        openxr.stage.places[WAIST_AT].connected = 1
        assert by_serial(driver.poll(1.3))[WAIST].tracked
        told = [(event.kind, event.serial, event.time_s) for event in driver.events()]
        assert told == [(EventKind.GONE, WAIST, 1.1), (EventKind.BACK, WAIST, 1.3)]
        assert WAIST in {device.serial for device in driver.devices()}

    def test_a_headset_put_aside_leaves_hands_and_trackers_asleep(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        driver.poll(1.0)
        openxr.send(STATE_CHANGED, VISIBLE)
        for place in openxr.stage.places:
            place.flags = 0
        states = {sample.state for sample in driver.poll(1.1)}
        assert states == {TrackingState.ASLEEP}
        openxr.send(STATE_CHANGED, FOCUSED)
        for place in openxr.stage.places:
            place.flags = IN_SIGHT
        assert all(sample.tracked for sample in driver.poll(1.2))
        assert not driver.events()

    def test_a_runtime_that_withholds_the_focus_still_gives_the_head(
        self, openxr: OpenXR, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(driver_module, "START_S", 0.02)
        openxr.stage.focus_withheld = 1
        with load_driver("openxr") as driver:
            assert list(by_serial(driver.poll(1.0))) == ["OPENXR-HEAD"]

    @pytest.mark.parametrize(("kind", "value"), [(STATE_CHANGED, LOSS_PENDING), (INSTANCE_LOST, 0)])
    def test_when_the_runtime_ends_everything_is_gone(
        self, driver: TrackerDriver, openxr: OpenXR, kind: int, value: int
    ) -> None:
        driver.poll(1.0)
        openxr.send(kind, value)
        states = [sample.state for sample in driver.poll(1.1)]
        assert states == [TrackingState.GONE] * 4
        assert {event.serial for event in driver.events()} == set(SERIALS)
        assert not driver.poll(1.2)
        assert openxr.stage.destroyed == 1
        driver.close()
        assert openxr.stage.destroyed == 1

    def test_a_runtime_that_dies_while_asked_is_everything_gone(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        driver.poll(1.0)
        openxr.stage.refuse_locate = -13  # the instance is lost
        assert {sample.state for sample in driver.poll(1.1)} == {TrackingState.GONE}
        openxr.stage.refuse_locate = 0
        driver.open()
        assert len(driver.poll(1.2)) == 4

    def test_a_session_that_is_stopped_is_ended_and_its_devices_gone(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        driver.poll(1.0)
        openxr.send(STATE_CHANGED, STOPPING)
        assert {sample.state for sample in driver.poll(1.1)} == {TrackingState.GONE}
        assert openxr.stage.ended == 1


class TestRoles:
    def test_hands_and_trackers_stand_for_what_the_runtime_says(
        self, driver: TrackerDriver
    ) -> None:
        hints = {device.serial: device.role_hint for device in driver.devices()}
        assert hints == {
            "OPENXR-HEAD": TrackerRole.HEAD,
            "OPENXR-LEFT-HAND": TrackerRole.LEFT_HAND,
            "OPENXR-RIGHT-HAND": TrackerRole.RIGHT_HAND,
            WAIST: TrackerRole.PELVIS,
        }

    def test_the_chosen_serial_goes_before_the_runtimes_role(self, openxr: OpenXR) -> None:
        openxr.add(OTHER_AT, f"{TRACKER_ROLE}chest", "/devices/htc/vive_trackerLHR-MINE")
        with load_driver("openxr:pelvis=LHR-MINE") as driver:
            assert info_of(driver, "LHR-MINE").role_hint is TrackerRole.PELVIS
            assert info_of(driver, WAIST).role_hint is None

    def test_a_tracker_that_gets_another_role_keeps_its_serial(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        driver.poll(1.0)
        openxr.stage.places[WAIST_AT].path = f"{TRACKER_ROLE}chest".encode()
        openxr.send(TRACKER_CONNECTED)
        assert by_serial(driver.poll(1.1))[WAIST].tracked
        assert info_of(driver, WAIST).role_hint is TrackerRole.CHEST
        assert not driver.events()

    @pytest.mark.parametrize("path", ["", f"{TRACKER_ROLE}keyboard"])
    def test_a_tracker_without_a_role_of_the_body_is_left_out(
        self, openxr: OpenXR, path: str
    ) -> None:
        openxr.stage.places[WAIST_AT].path = path.encode()
        with load_driver("openxr") as driver:
            assert WAIST not in by_serial(driver.poll(1.0))

    def test_another_form_of_persistent_path_still_gives_a_serial(self, openxr: OpenXR) -> None:
        openxr.stage.places[WAIST_AT].persistent = b"/devices/other/xyz-7"
        with load_driver("openxr") as driver:
            assert "xyz-7" in by_serial(driver.poll(1.0))


class TestMonadosList:
    def test_a_tracker_without_a_role_comes_from_the_list(self, openxr: OpenXR) -> None:
        openxr.stage.places[OTHER_AT].connected = 1
        openxr.stage.places[OTHER_AT].flags = IN_SIGHT
        openxr.move(OTHER_AT, np.eye(3), np.array([0.5, 0.25, -0.5]))
        openxr.add_xdev(0, "A headset", "HMD-1", HEAD_AT)
        openxr.add_xdev(1, "Vive Tracker 3.0", "LHR-LOOSE", OTHER_AT)
        openxr.add_xdev(2, "A Hand Tracker", "HT-1", LEFT_AT)
        openxr.add_xdev(3, "Fixed Tracker", "NONE-1", LEFT_AT).can_create_space = 0
        with load_driver("openxr") as driver:
            given = by_serial(driver.poll(1.0))
            info = info_of(driver, "LHR-LOOSE")
        assert set(given) == {*SERIALS, "LHR-LOOSE"}
        pose = given["LHR-LOOSE"].T_world_tracker
        assert pose.p is not None
        assert pose.p.tolist() == [0.5, 0.25, -0.5]
        assert (info.kind, info.model, info.role_hint) == ("tracker", "Vive Tracker 3.0", None)

    def test_a_tracker_with_a_role_is_not_given_twice(self, openxr: OpenXR) -> None:
        openxr.add_xdev(0, "Vive Tracker 3.0", WAIST, WAIST_AT)
        with load_driver("openxr") as driver:
            assert len(driver.poll(1.0)) == 4
            assert info_of(driver, WAIST).role_hint is TrackerRole.PELVIS

    def test_the_list_may_change(self, openxr: OpenXR) -> None:
        openxr.stage.places[OTHER_AT].connected = 1
        with load_driver("openxr") as driver:
            driver.poll(1.0)
            xdev = openxr.add_xdev(0, "Vive Tracker 3.0", "LHR-LATE", OTHER_AT)
            assert "LHR-LATE" in by_serial(driver.poll(1.1))
            xdev.there = 0
            openxr.stage.xdev_generation += 1
            assert by_serial(driver.poll(1.2))["LHR-LATE"].state is TrackingState.GONE

    @pytest.mark.parametrize("without", [WITHOUT_VIVE, WITHOUT_XDEV, WITHOUT_VIVE | WITHOUT_XDEV])
    def test_either_extension_may_be_missing(self, openxr: OpenXR, without: int) -> None:
        openxr.stage.without = without
        with load_driver("openxr") as driver:
            assert len(driver.poll(1.0)) == (3 if without & WITHOUT_VIVE else 4)


class TestEvents:
    @pytest.mark.parametrize("name", BUTTONS)
    def test_a_button_goes_down_and_up_at_its_own_time(
        self, driver: TrackerDriver, openxr: OpenXR, name: str
    ) -> None:
        driver.poll(1.0)
        place = openxr.stage.places[RIGHT_AT]
        for pressed, now_s in ((1, 1.5), (1, 2.0), (0, 2.5)):
            began_ns = openxr.stage.last_time_ns
            openxr.wait(0.5)
            if place.pressed[BUTTONS.index(name)] != pressed:
                place.pressed[BUTTONS.index(name)] = pressed
                place.changed_ns = began_ns + 200_000_000
            driver.poll(now_s)
        down, up = driver.events()
        assert {down.serial, up.serial} == {"OPENXR-RIGHT-HAND"}
        assert (down.kind, down.name) == (EventKind.BUTTON_DOWN, name)
        assert (up.kind, up.name) == (EventKind.BUTTON_UP, name)
        assert [down.time_s, up.time_s] == pytest.approx([1.2, 2.2], abs=1e-3)

    @pytest.mark.parametrize("lost", ["plug", "focus"])
    def test_a_button_held_when_its_controller_is_lost_is_let_go(
        self, driver: TrackerDriver, openxr: OpenXR, lost: str
    ) -> None:
        place = openxr.stage.places[LEFT_AT]
        place.pressed[0] = 1
        driver.poll(1.0)
        if lost == "plug":
            place.connected = 0
        else:
            openxr.send(STATE_CHANGED, VISIBLE)
        driver.poll(1.1)
        told = [event.kind for event in driver.events()]
        assert told[:1] == [EventKind.BUTTON_DOWN]
        assert EventKind.BUTTON_UP in told

    def test_a_focus_lost_before_it_is_said_does_no_harm(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        driver.poll(1.0)
        openxr.stage.focus_lost_unsaid = 1
        assert all(sample.tracked for sample in driver.poll(1.1))

    def test_a_shift_of_the_floor_is_told(self, driver: TrackerDriver, openxr: OpenXR) -> None:
        openxr.send(SPACE_CHANGING, LOCAL)
        driver.poll(1.0)
        assert not driver.events()
        openxr.send(SPACE_CHANGING, STAGE)
        driver.poll(1.1)
        assert [event.kind for event in driver.events()] == [EventKind.RECENTRED]

    def test_a_message_nobody_knows_is_passed_over(
        self, driver: TrackerDriver, openxr: OpenXR
    ) -> None:
        openxr.send(1999999999)
        assert len(driver.poll(1.0)) == 4


class TestRefusals:
    @pytest.mark.parametrize(
        ("field", "code", "kind", "what_to_do"),
        [
            ("instance", -2, DriverUnavailable, "Restart it"),
            ("instance", -10, DeviceBusy, "Close other programs"),
            ("system", -34, TrackerNotFound, "no headset"),
            ("system", -35, TrackerNotFound, "Plug it in"),
            ("session", -10, DeviceBusy, "Close other programs"),
            ("session", -999, DriverUnavailable, "Restart it"),
        ],
    )
    def test_a_session_refused_says_what_to_do(
        self,
        openxr: OpenXR,
        field: str,
        code: int,
        kind: type[DriverError],
        what_to_do: str,
    ) -> None:
        setattr(openxr.stage, f"refuse_{field}", code)
        driver = load_driver("openxr")
        with pytest.raises(kind, match=what_to_do) as refusal:
            driver.open()
        assert type(refusal.value) is kind
        assert refusal.value.__cause__ is not None
        assert openxr.stage.instances == openxr.stage.destroyed
        setattr(openxr.stage, f"refuse_{field}", 0)
        driver.open()
        assert len(driver.poll(2.0)) == 4
        driver.close()

    def test_a_runtime_that_must_draw_is_refused(self, openxr: OpenXR) -> None:
        openxr.stage.without = WITHOUT_HEADLESS
        with pytest.raises(DriverUnavailable, match="lacks XR_MND_headless"):
            load_driver("openxr").open()

    def test_without_a_runtime_open_says_so(self, manifest: Path) -> None:
        code = (
            "from lobstr_hw.drivers import load_driver\n"
            "from lobstr_hw.errors import DriverUnavailable\n"
            "try: load_driver('openxr').open()\n"
            "except DriverUnavailable as error: print(error)"
        )
        # a process of its own, for the loader keeps the first runtime that it has found
        nowhere = {**os.environ, "XR_RUNTIME_JSON": f"{manifest}.none", "XR_LOADER_DEBUG": "none"}
        out = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=nowhere
        )
        assert "no OpenXR runtime is active" in out.stdout
