"""The openvr driver on a fake SteamVR, through the real package and its native loader."""

import ctypes
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.driver_contract import DriverContract, Make
from support.steamvr_bed import (
    BASE_STATION,
    CONTROLLER,
    HEADSET,
    LEFT,
    RIGHT,
    TRACKER,
    SteamVR,
    build_runtime,
    running_steamvr,
)

from lobstr_hw.drivers import load_driver
from lobstr_hw.drivers.driver import DeviceInfo, EventKind, TrackerDriver
from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound
from lobstr_hw.rotations import from_rotation_vector
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

pytestmark = pytest.mark.bed

HEAD, LEFT_HAND, RIGHT_HAND, WAIST, STATION = range(5)
SERIALS = ["LHR-HEAD0001", "LHR-LEFT0001", "LHR-RIGHT001", "LHR-WAIST001", "LHB-BASE0001"]

ACTIVATED, DEACTIVATED, ROLE_CHANGED, PROPERTY_CHANGED = 100, 101, 108, 111
BUTTON_PRESS, BUTTON_UNPRESS = 200, 201
QUIT, UNIVERSE_CHANGED, STANDING_RESET, TRACKERS_CHANGED = 700, 801, 808, 866
SYSTEM, MENU, GRIP, A, TOUCHPAD, TRIGGER = 0, 1, 2, 7, 32, 33


@pytest.fixture(scope="session")
def registry(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_runtime(tmp_path_factory.mktemp("steamvr"))


@pytest.fixture
def empty_steamvr(registry: Path, tmp_path: Path) -> Iterator[SteamVR]:
    with running_steamvr(registry, tmp_path / "stage") as steamvr:
        yield steamvr


@pytest.fixture
def steamvr(empty_steamvr: SteamVR) -> SteamVR:
    empty_steamvr.add(HEAD, HEADSET, SERIALS[HEAD], "vive", p=(0.0, 1.7, 0.0))
    empty_steamvr.add(LEFT_HAND, CONTROLLER, SERIALS[LEFT_HAND], "vive_controller", LEFT)
    empty_steamvr.add(RIGHT_HAND, CONTROLLER, SERIALS[RIGHT_HAND], "vive_controller", RIGHT)
    empty_steamvr.add(WAIST, TRACKER, SERIALS[WAIST], "vive_tracker_waist")
    empty_steamvr.add(STATION, BASE_STATION, SERIALS[STATION])
    return empty_steamvr


@pytest.fixture
def driver(steamvr: SteamVR) -> Iterator[TrackerDriver]:
    with load_driver("openvr") as driver:
        yield driver


def by_serial(samples: object) -> dict[str, TrackerSample]:
    assert isinstance(samples, list)
    return {sample.serial: sample for sample in samples}


def role_of(driver: TrackerDriver, serial: str) -> TrackerRole | None:
    return info_of(driver, serial).role_hint


def info_of(driver: TrackerDriver, serial: str) -> DeviceInfo:
    return next(device for device in driver.devices() if device.serial == serial)


class TestOpenVRContract(DriverContract):
    @pytest.fixture
    def make(self, steamvr: SteamVR) -> Make:
        return lambda: load_driver("openvr")


class TestSession:
    def test_it_never_starts_steamvr(self, driver: TrackerDriver, steamvr: SteamVR) -> None:
        background = 3
        assert steamvr.stage.app_type == background

    def test_it_asks_for_the_standing_universe_without_prediction(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        standing = 1
        asked = steamvr.stage.poses_asked
        driver.poll(1.0)
        assert steamvr.stage.poses_asked == asked + 1
        assert (steamvr.stage.origin, steamvr.stage.predicted_s) == (standing, 0.0)

    def test_probing_and_making_begin_no_session(self, steamvr: SteamVR) -> None:
        assert type(load_driver("openvr")).probe().available
        assert steamvr.stage.inits == 0

    def test_every_session_that_began_ends(self, steamvr: SteamVR) -> None:
        for _ in range(3):
            with load_driver("openvr"):
                pass
        assert (steamvr.stage.inits, steamvr.stage.cleanups) == (3, 3)

    def test_opening_twice_begins_anew(self, steamvr: SteamVR) -> None:
        with load_driver("openvr") as driver:
            driver.open()
            assert len(driver.poll(1.0)) == 4
        assert steamvr.stage.inits == steamvr.stage.cleanups


class TestPoses:
    def test_a_pose_arrives_as_steamvr_has_it(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        rng = np.random.default_rng(5)
        for time_s in np.arange(1.0, 2.0, 0.1):
            p, R = rng.normal(size=(4, 3)), from_rotation_vector(rng.normal(size=(4, 3)))
            for index in range(4):
                steamvr.move(index, R[index], p[index])
                steamvr.stage.devices[index].velocity[:] = p[index][::-1].tolist()
            given = by_serial(driver.poll(time_s))
            for index in range(4):
                sample = given[SERIALS[index]]
                assert (sample.tracked, sample.state) == (True, TrackingState.OK)
                assert sample.time_s == time_s
                assert sample.T_world_tracker.p is not None
                np.testing.assert_allclose(sample.T_world_tracker.p, p[index], atol=1e-6)
                np.testing.assert_allclose(sample.T_world_tracker.R, R[index], atol=1e-6)
                assert sample.velocity is not None
                np.testing.assert_allclose(sample.velocity, p[index][::-1], atol=1e-6)

    def test_a_sample_keeps_its_pose_when_the_device_moves_on(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        steamvr.move(WAIST, np.eye(3), np.array([1.0, 1.0, 1.0]))
        sample = by_serial(driver.poll(1.0))[SERIALS[WAIST]]
        steamvr.move(WAIST, np.eye(3), np.array([2.0, 2.0, 2.0]))
        driver.poll(2.0)
        assert sample.T_world_tracker.p is not None
        assert sample.T_world_tracker.p.tolist() == [1.0, 1.0, 1.0]

    @pytest.mark.parametrize(
        ("result", "valid", "state"),
        [
            (1, True, TrackingState.CALIBRATING),
            (100, True, TrackingState.CALIBRATING),
            (101, True, TrackingState.OUT_OF_RANGE),
            (101, False, TrackingState.OUT_OF_RANGE),
            (200, False, TrackingState.OCCLUDED),
            (201, True, TrackingState.OUT_OF_RANGE),
            (300, True, TrackingState.INERTIAL),
            (999, True, TrackingState.OCCLUDED),
        ],
    )
    def test_only_running_and_valid_counts_as_tracked(
        self,
        driver: TrackerDriver,
        steamvr: SteamVR,
        result: int,
        valid: bool,
        state: TrackingState,
    ) -> None:
        device = steamvr.stage.devices[WAIST]
        device.result, device.valid = result, valid
        sample = by_serial(driver.poll(1.0))[SERIALS[WAIST]]
        assert (sample.tracked, sample.state) == (False, state)
        assert sample.velocity is None

    def test_a_rotation_without_a_place_has_no_place(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        R = from_rotation_vector(np.array([0.1, -0.4, 0.2]))
        steamvr.move(WAIST, R, np.array([5.0, 5.0, 5.0]))
        steamvr.stage.devices[WAIST].result = 300
        pose = by_serial(driver.poll(1.0))[SERIALS[WAIST]].T_world_tracker
        assert pose.p is None
        np.testing.assert_allclose(pose.R, R, atol=1e-6)

    def test_what_is_out_of_sight_is_held_where_it_was_last_tracked(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        steamvr.move(WAIST, np.eye(3), np.array([1.0, 2.0, 3.0]))
        driver.poll(1.0)
        device = steamvr.stage.devices[WAIST]
        device.result = 300  # in between only the rotation is known
        driver.poll(1.1)
        steamvr.move(WAIST, np.zeros((3, 3)), np.zeros(3))
        device.result, device.valid = 200, 0
        pose = by_serial(driver.poll(1.2))[SERIALS[WAIST]].T_world_tracker
        assert pose.p is not None
        assert pose.p.tolist() == [1.0, 2.0, 3.0]
        np.testing.assert_array_equal(pose.R, np.eye(3))

    def test_what_was_never_in_sight_is_nowhere(self, empty_steamvr: SteamVR) -> None:
        empty_steamvr.add(0, TRACKER, "LHR-X").valid = 0
        with load_driver("openvr") as driver:
            assert by_serial(driver.poll(1.0))["LHR-X"].T_world_tracker.p is None


class TestComingAndGoing:
    def test_a_pulled_plug_is_told_once_and_a_return_too(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        device = steamvr.stage.devices[WAIST]
        driver.poll(1.0)
        device.connected = device.valid = 0
        last = by_serial(driver.poll(1.1))[SERIALS[WAIST]]
        assert (last.tracked, last.state) == (False, TrackingState.GONE)
        assert SERIALS[WAIST] not in by_serial(driver.poll(1.2))
        device.connected = device.valid = 1
        assert by_serial(driver.poll(1.3))[SERIALS[WAIST]].tracked
        told = [(event.kind, event.serial, event.time_s) for event in driver.events()]
        serial = SERIALS[WAIST]
        assert told == [(EventKind.GONE, serial, 1.1), (EventKind.BACK, serial, 1.3)]

    def test_a_device_that_is_gone_stays_in_the_list(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        steamvr.stage.devices[WAIST].connected = 0
        steamvr.raise_event(DEACTIVATED, WAIST)
        driver.poll(1.0)
        assert info_of(driver, SERIALS[WAIST]).role_hint is TrackerRole.PELVIS

    def test_a_device_that_wakes_up_later_joins(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        steamvr.add(9, TRACKER, "", "vive_tracker_left_foot")
        steamvr.raise_event(ACTIVATED, 9)
        assert len(driver.poll(1.0)) == 4  # without its serial nobody could tell who it is
        steamvr.stage.devices[9].serial = b"LHR-LATE"
        assert "LHR-LATE" in by_serial(driver.poll(1.1))
        assert role_of(driver, "LHR-LATE") is TrackerRole.LEFT_FOOT
        assert not driver.events()

    def test_a_lost_base_station_is_told_but_gives_no_samples(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        assert info_of(driver, SERIALS[STATION]).kind == "base_station"
        steamvr.stage.devices[STATION].connected = 0
        assert SERIALS[STATION] not in by_serial(driver.poll(1.0))
        assert [(e.kind, e.serial) for e in driver.events()] == [(EventKind.GONE, SERIALS[STATION])]

    def test_when_steamvr_quits_the_driver_leaves_and_everything_is_gone(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        driver.poll(1.0)
        steamvr.raise_event(QUIT)
        states = {sample.state for sample in driver.poll(1.1)}
        assert states == {TrackingState.GONE}
        assert (steamvr.stage.quits_acknowledged, steamvr.stage.cleanups) == (1, 1)
        assert {event.serial for event in driver.events()} == set(SERIALS)
        assert not driver.poll(1.2)
        assert len(driver.devices()) == len(SERIALS)
        driver.close()
        assert steamvr.stage.cleanups == 1

    def test_after_a_quit_it_opens_again(self, driver: TrackerDriver, steamvr: SteamVR) -> None:
        steamvr.raise_event(QUIT)
        driver.poll(1.0)
        driver.open()
        assert len(driver.poll(1.1)) == 4

    def test_a_flood_of_events_is_spread_over_polls(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        for _ in range(400):
            steamvr.raise_event(PROPERTY_CHANGED)
        driver.poll(1.0)
        assert 0 < steamvr.stage.events_read < 400
        driver.poll(2.0)
        assert steamvr.stage.events_read == 400


class TestRoles:
    def test_the_chosen_serial_goes_before_what_steamvr_says(self, steamvr: SteamVR) -> None:
        steamvr.add(5, TRACKER, "LHR-MINE", "vive_tracker_chest")
        with load_driver("openvr:pelvis=LHR-MINE") as driver:
            assert role_of(driver, "LHR-MINE") is TrackerRole.PELVIS
            assert role_of(driver, SERIALS[WAIST]) is None

    def test_the_users_setting_goes_before_the_type(self, steamvr: SteamVR) -> None:
        steamvr.stage.devices[WAIST].registered_type = b"htc/vive_trackerLHR-WAIST001"
        steamvr.set_role("htc/vive_trackerLHR-WAIST001", "TrackerRole_LeftFoot")
        with load_driver("openvr") as driver:
            assert role_of(driver, SERIALS[WAIST]) is TrackerRole.LEFT_FOOT

    def test_the_setting_of_any_driver_is_found(self, steamvr: SteamVR) -> None:
        steamvr.add(5, TRACKER, "hip-7").registered_type = b"slimevr/hip-7"
        steamvr.set_role("slimevr/hip-7", "TrackerRole_Chest")
        with load_driver("openvr") as driver:
            assert role_of(driver, "hip-7") is TrackerRole.CHEST

    def test_a_role_changed_while_running_is_seen(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        assert role_of(driver, SERIALS[WAIST]) is TrackerRole.PELVIS
        steamvr.stage.devices[WAIST].registered_type = b"lighthouse/nothing is set for this"
        steamvr.set_role(f"htc/vive_tracker{SERIALS[WAIST]}", "TrackerRole_Chest")
        steamvr.raise_event(TRACKERS_CHANGED)
        driver.poll(1.0)
        assert role_of(driver, SERIALS[WAIST]) is TrackerRole.CHEST

    def test_hands_that_swap_are_seen(self, driver: TrackerDriver, steamvr: SteamVR) -> None:
        steamvr.stage.devices[LEFT_HAND].hand = RIGHT
        steamvr.stage.devices[RIGHT_HAND].hand = LEFT
        steamvr.raise_event(ROLE_CHANGED, LEFT_HAND)
        driver.poll(1.0)
        assert role_of(driver, SERIALS[LEFT_HAND]) is TrackerRole.RIGHT_HAND
        assert role_of(driver, SERIALS[RIGHT_HAND]) is TrackerRole.LEFT_HAND

    def test_a_tracker_held_in_a_hand_is_a_tracker_that_stands_for_the_hand(
        self, empty_steamvr: SteamVR
    ) -> None:
        empty_steamvr.add(0, CONTROLLER, "LHR-HELD", "vive_tracker_handed", LEFT)
        with load_driver("openvr") as driver:
            info = info_of(driver, "LHR-HELD")
        assert (info.kind, info.role_hint) == ("tracker", TrackerRole.LEFT_HAND)

    def test_a_wireless_adapter_that_poses_as_a_tracker_in_a_hand_is_no_hand(
        self, empty_steamvr: SteamVR
    ) -> None:
        empty_steamvr.add(0, TRACKER, "LHR-ADAPTER", "vive_tracker_handed", LEFT)
        with load_driver("openvr") as driver:
            assert role_of(driver, "LHR-ADAPTER") is None

    def test_a_role_taken_off_a_hand_is_seen_while_running(self, empty_steamvr: SteamVR) -> None:
        device = empty_steamvr.add(0, CONTROLLER, "LHR-HELD", "vive_tracker_handed", LEFT)
        with load_driver("openvr") as driver:
            device.device_class, device.hand = TRACKER, 0
            device.controller_type = b"vive_tracker_waist"
            empty_steamvr.raise_event(ROLE_CHANGED, 0)
            driver.poll(1.0)
            assert role_of(driver, "LHR-HELD") is TrackerRole.PELVIS

    def test_without_the_settings_interface_the_type_still_tells(self, steamvr: SteamVR) -> None:
        steamvr.stage.hidden_interface = 2
        with load_driver("openvr") as driver:
            assert role_of(driver, SERIALS[WAIST]) is TrackerRole.PELVIS


class TestDevices:
    def test_model_firmware_battery_and_worn_are_told(self, steamvr: SteamVR) -> None:
        head = steamvr.stage.devices[HEAD]
        head.activity, head.firmware, head.battery = 1, b"1601", 0.25
        with load_driver("openvr") as driver:
            info = info_of(driver, SERIALS[HEAD])
            waist = info_of(driver, SERIALS[WAIST])
        assert (info.kind, info.model, info.firmware) == ("headset", "a model", "1601")
        assert (info.battery, info.worn) == (0.25, True)
        assert (waist.kind, waist.firmware, waist.battery, waist.worn) == (
            "tracker",
            "",
            None,
            None,
        )

    def test_a_headset_taken_off_and_a_battery_going_down_are_seen(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        standing_by = 3
        steamvr.stage.devices[HEAD].activity = standing_by
        steamvr.stage.devices[HEAD].battery = 0.5
        steamvr.raise_event(PROPERTY_CHANGED, HEAD)
        driver.poll(1.0)
        info = info_of(driver, SERIALS[HEAD])
        assert (info.worn, info.battery) == (False, 0.5)


class TestEvents:
    @pytest.mark.parametrize(
        ("controller_type", "number", "name"),
        [
            ("vive_controller", SYSTEM, "system"),
            ("vive_controller", MENU, "menu"),
            ("vive_controller", GRIP, "grip"),
            ("vive_controller", TRIGGER, "trigger"),
            ("knuckles", MENU, "b"),
            ("knuckles", GRIP, "a"),
            ("oculus_touch", A, "a"),
            ("oculus_touch", MENU, "b"),
        ],
    )
    def test_buttons_go_down_and_up(
        self,
        driver: TrackerDriver,
        steamvr: SteamVR,
        controller_type: str,
        number: int,
        name: str,
    ) -> None:
        steamvr.stage.devices[LEFT_HAND].controller_type = controller_type.encode()
        steamvr.raise_event(BUTTON_PRESS, LEFT_HAND, 0.0, number)
        steamvr.raise_event(BUTTON_UNPRESS, LEFT_HAND, 0.0, number)
        driver.poll(1.0)
        told = [(event.kind, event.serial, event.name) for event in driver.events()]
        serial = SERIALS[LEFT_HAND]
        assert told == [(EventKind.BUTTON_DOWN, serial, name), (EventKind.BUTTON_UP, serial, name)]

    def test_the_touchpad_is_no_button(self, driver: TrackerDriver, steamvr: SteamVR) -> None:
        steamvr.raise_event(BUTTON_PRESS, LEFT_HAND, 0.0, TOUCHPAD)
        driver.poll(1.0)
        assert not driver.events()

    def test_a_press_is_told_once_and_a_release_only_after_it(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        kinds = (BUTTON_UNPRESS, BUTTON_PRESS, BUTTON_PRESS, BUTTON_UNPRESS, BUTTON_UNPRESS)
        for kind in kinds:
            steamvr.raise_event(kind, LEFT_HAND, 0.0, TRIGGER)
        driver.poll(1.0)
        told = [event.kind for event in driver.events()]
        assert told == [EventKind.BUTTON_DOWN, EventKind.BUTTON_UP]

    def test_an_event_has_its_own_time_between_the_polls(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        driver.poll(1.0)
        steamvr.raise_event(BUTTON_PRESS, LEFT_HAND, 0.25, TRIGGER)
        steamvr.raise_event(BUTTON_UNPRESS, LEFT_HAND, 7.0, TRIGGER)  # older than the last poll
        driver.poll(1.5)
        assert sorted(event.time_s for event in driver.events()) == [1.0, 1.25]

    def test_a_button_held_when_the_plug_is_pulled_is_let_go(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        steamvr.raise_event(BUTTON_PRESS, LEFT_HAND, 0.0, TRIGGER)
        driver.poll(1.0)
        steamvr.stage.devices[LEFT_HAND].connected = 0
        driver.poll(1.1)
        told = [event.kind for event in driver.events()]
        assert told == [EventKind.BUTTON_DOWN, EventKind.BUTTON_UP, EventKind.GONE]

    def test_a_shift_of_the_room_is_told_once(
        self, driver: TrackerDriver, steamvr: SteamVR
    ) -> None:
        steamvr.raise_event(UNIVERSE_CHANGED, 0, 0.01)
        steamvr.raise_event(STANDING_RESET)
        driver.poll(1.0)
        assert [event.kind for event in driver.events()] == [EventKind.RECENTRED]


class TestRefusals:
    @pytest.mark.parametrize(
        ("code", "kind", "what_to_do"),
        [
            (100, DriverUnavailable, "Install Steam and SteamVR"),
            (105, DriverUnavailable, "Update SteamVR"),
            (108, TrackerNotFound, "Plug it in"),
            (121, DriverUnavailable, "is not running. Start it"),
            (117, DeviceBusy, "Wait until it is ready"),
            (137, DeviceBusy, "Wait until it is ready"),
            (301, DriverUnavailable, "Restart SteamVR"),
            (99999, DriverUnavailable, "Restart SteamVR"),
        ],
    )
    def test_a_session_refused_says_what_to_do(
        self, steamvr: SteamVR, code: int, kind: type[DriverError], what_to_do: str
    ) -> None:
        steamvr.stage.init_error = code
        driver = load_driver("openvr")
        with pytest.raises(kind, match=what_to_do) as refusal:
            driver.open()
        assert type(refusal.value) is kind
        assert refusal.value.__cause__ is not None
        assert not driver.poll(1.0)
        steamvr.stage.init_error = 0
        driver.open()
        assert len(driver.poll(2.0)) == 4
        driver.close()

    def test_a_steamvr_of_another_age_is_refused_and_left(self, steamvr: SteamVR) -> None:
        steamvr.stage.hidden_interface = 1
        with pytest.raises(DriverUnavailable, match="Update SteamVR"):
            load_driver("openvr").open()
        assert steamvr.stage.cleanups == steamvr.stage.inits == 1

    def test_without_steamvr_probe_and_open_say_so(
        self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        monkeypatch.setenv("VR_PATHREG_OVERRIDE", str(tmp_path / "none"))
        driver = load_driver("openvr")
        assert not type(driver).probe().available
        assert "SteamVR" in type(driver).probe().fix
        with pytest.raises(DriverUnavailable, match="Install Steam and SteamVR"):
            driver.open()

    def test_a_package_with_other_poses_is_refused(
        self, steamvr: SteamVR, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        import openvr

        monkeypatch.setattr(openvr, "TrackedDevicePose_t", ctypes.c_int64)
        with pytest.raises(DriverUnavailable, match="has 8 bytes, not 80"):
            load_driver("openvr").open()
        assert steamvr.stage.inits == 0
