"""The driver in a made-up room: devices on a fake bus, time in the test's hands."""

import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.fake_clock import FakeClock
from support.fake_transport import FakeOpenDevice, FakeTransport
from support.lighthouse_devices import Bench, HandedOut, named, scripted_device
from support.lighthouse_room import Motion, carried, room, still
from support.lighthouse_wire import TimedReport, reports_of
from support.scripted_usb import ScriptedDevice
from support.stream_contract import Sent, StreamDriverContract
from support.waiting import wait_until

from lobstr_hw.drivers import load_driver, reading_thread, stream
from lobstr_hw.drivers.driver import EventKind, TrackerDriver
from lobstr_hw.drivers.lighthouse import device_session, hub, tracked_device
from lobstr_hw.drivers.lighthouse import driver as driver_module
from lobstr_hw.drivers.lighthouse.device_follower import About, DeviceFollower
from lobstr_hw.drivers.lighthouse.device_session import DeviceSession
from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.lighthouse.light_mode import LightMode
from lobstr_hw.drivers.lighthouse.sight import Sight
from lobstr_hw.drivers.lighthouse.station_file import save_stations
from lobstr_hw.drivers.lighthouse.steamvr import steamvr_runs
from lobstr_hw.drivers.lighthouse.survey import FIRST_WORDS
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.transport import RawReport, UsbDeviceInfo
from lobstr_hw.drivers.reading_thread import Reading
from lobstr_hw.errors import DeviceBusy, DriverUnavailable, TrackerNotFound
from lobstr_hw.trackers import TrackingState

STATIONS = room(2)
TRACKER = named("LHR-0000000A")


@pytest.fixture
def station_file(tmp_path: Path) -> Path:
    path = tmp_path / "stations.json"
    save_stations(path, STATIONS, {})
    return path


class OneTracker:
    """A tracker by cable that begins by itself, then sends one IMU sample after the other."""

    serials = frozenset({TRACKER.serial})
    has_clock = True
    has_line = True

    def __init__(self, station_file: Path) -> None:
        self.file = station_file
        self.motion = carried(1)
        self.reports = reports_of(STATIONS, TRACKER, self.motion, 2.5)
        self.first = next(k for k, r in enumerate(self.reports) if r.ticks > 48_000_000 * 0.3)
        self.on_opening = self._given(self.reports[: self.first])
        self.device = Rewinding(scripted_device(TRACKER, self.reports), self.first)
        self.transport = FakeTransport([self.device])

    def _given(self, reports: list[TimedReport]) -> int:
        """How many samples so many reports give."""
        tracked = TrackedDevice(TRACKER, STATIONS)
        about = About(TRACKER, "", None, LightMode(True, True, True))
        follower = DeviceFollower(tracked, about, Sight(99), "")
        told = [n for r in reports for n in follower.feed(RawReport(0, r.data, 0.0), False)]
        return sum(isinstance(n, Reading) and n.T_world_tracker is not None for n in told)

    def make(self) -> TrackerDriver:
        """Open, it has found its pose: a search takes long on a busy machine."""
        driver = LighthouseDriver(self.file, self.transport)
        claim = driver.open

        def open_and_find() -> None:
            claim()
            thread = driver._thread
            assert thread is not None
            wait_until(lambda: len(thread._arrivals) >= self.on_opening, "it is found", 60.0)

        setattr(driver, "open", open_and_find)  # noqa: B010
        return driver

    def send(self, frames: int) -> list[Sent]:
        sent: list[Sent] = []
        count, at = 0, self.device.at
        while len(sent) < frames:
            report = self.reports[at + count]
            count += 1
            if report.data[0] == 0x20:
                t = (report.ticks - 1_000_000) / 48e6
                sent.append((TRACKER.serial, t, self.motion.p(np.array([t]))[0]))
        self.device.at += count
        self.device.play(count)
        return sent

    def cut(self) -> None:
        self.device.unplug()

    def restore(self) -> None:
        self.device.plug()


class Rewinding(HandedOut):
    """Begins its script anew whenever it is opened, and plays the beginning by itself."""

    def __init__(self, script: ScriptedDevice, first: int) -> None:
        self._first = first
        self.at = first
        super().__init__(script)
        self.held_back = True

    @property
    def opened(self) -> int:
        return self._opened

    @opened.setter
    def opened(self, count: int) -> None:
        if count > getattr(self, "_opened", 0):
            self._next = self._allowed = 0
            self.at = self._first
            self._opened_s = perf_counter()
            self.play(self._first)
        self._opened = count

    def _now_s(self) -> float:
        """What it sends by itself comes when it is due, not as fast as it can be read."""
        if self._next > self._first:
            return perf_counter()
        due_s = [time_s for time_s, _, _ in self.script.reports[: self._first]]
        return self._opened_s + due_s[self._next - 1] - due_s[-1]


class TestContract(StreamDriverContract):
    @pytest.fixture
    def bed(self, station_file: Path, monkeypatch: pytest.MonkeyPatch) -> OneTracker:
        monkeypatch.setattr(hub, "LOOK_S", 0.01)
        monkeypatch.setattr(tracked_device, "STEP", 1)  # every sample at once
        monkeypatch.setattr(stream, "SILENCE_S", 60.0)  # a busy machine is no silence
        # the made-up transport needs no USB library, so that of the driver's need not be there
        monkeypatch.setattr(driver_module, "available_transports", lambda: (["made up"], []))
        return OneTracker(station_file)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    """The only clock there is."""
    made = FakeClock(0.0)
    monkeypatch.setattr(stream, "perf_counter", made.now_s)
    monkeypatch.setattr(reading_thread, "perf_counter", made.now_s)
    monkeypatch.setattr(hub, "LOOK_S", 0.01)
    return made


@pytest.fixture(autouse=True)
def nothing_is_left_behind() -> Iterator[None]:
    before = set(threading.enumerate())
    yield
    left = [t for t in threading.enumerate() if t not in before and t.name.startswith("lobstr")]
    assert not left


FOUR = (
    named("LHR-0000000H", "hmd", "Utah MP"),
    named("LHR-0000000L", "controller", "Knuckles EV3.0 Left"),
    named("LHR-0000000R", "controller", "Knuckles EV3.0 Right"),
    TRACKER,
)


def four(seconds: float) -> list[ScriptedDevice]:
    return [
        scripted_device(model, reports_of(STATIONS, model, carried(k), seconds, seed=k), 2 + k)
        for k, model in enumerate(FOUR)
    ]


def test_four_devices_give_every_imu_sample_a_pose_at_its_own_time(
    clock: FakeClock, station_file: Path
) -> None:
    bench = Bench(four(1.1), clock, lambda usb: LighthouseDriver(station_file, usb))
    with bench.driver as driver:
        samples = bench.run_to(1.1)
        devices = {d.serial: d for d in driver.devices()}
    for k, model in enumerate(FOUR):
        mine = [s for s in samples if s.serial == model.serial and s.tracked]
        times = np.array([s.time_s for s in mine])
        assert len(mine) > 0.9 * 250 * 0.7
        np.testing.assert_allclose(np.diff(times), 0.004, atol=1e-6)
        p = np.array([s.T_world_tracker.p for s in mine])
        assert np.median(np.linalg.norm(p - carried(k).p(times), axis=1)) < 1e-3
        assert all(s.velocity is not None and s.covariance is not None for s in mine)
        assert devices[model.serial].stations_in_view == 2
        assert 4 < (devices[model.serial].sensors_hit or 0) <= 22
        assert devices[model.serial].firmware == "5f12ab34"
    roles = [devices[model.serial].role_hint for model in FOUR]
    assert roles == ["head", "left_hand", "right_hand", None]
    kinds = [devices[model.serial].kind for model in FOUR]
    assert kinds == ["headset", "controller", "controller", "tracker"]
    assert {s for s, d in devices.items() if d.kind == "base_station"} == {
        "LHB-000003E8",
        "LHB-000003E9",
    }
    assert all(not device.opened for device in bench.devices)


def test_samples_of_a_poll_are_oldest_first_and_none_is_of_the_future(
    clock: FakeClock, station_file: Path
) -> None:
    bench = Bench(four(0.5), clock, lambda usb: LighthouseDriver(station_file, usb))
    with bench.driver as driver:
        last = dict.fromkeys((m.serial for m in FOUR), -1.0)
        for _ in range(20):
            clock.advance(1 / 45)
            bench.settle()
            samples = driver.poll(clock.now_s())
            times = [s.time_s for s in samples]
            assert times == sorted(times)
            assert all(t <= clock.now_s() for t in times)
            for s in samples:
                assert s.time_s > last[s.serial]
                last[s.serial] = s.time_s


def test_a_role_goes_to_the_serial_that_the_user_named(
    clock: FakeClock, station_file: Path
) -> None:
    bench = Bench(
        four(0.1),
        clock,
        lambda usb: LighthouseDriver(station_file, usb, pelvis=TRACKER.serial, head="LHR-0000000R"),
    )
    with bench.driver as driver:
        roles = {d.serial: d.role_hint for d in driver.devices()}
    assert roles[TRACKER.serial] == "pelvis"
    assert roles["LHR-0000000R"] == "head"
    assert roles["LHR-0000000H"] is None, "there is one head"


def one(motion: Motion, seconds: float, **how: Any) -> list[ScriptedDevice]:
    return [scripted_device(TRACKER, reports_of(STATIONS, TRACKER, motion, seconds, **how))]


def test_in_the_dark_it_is_reckoned_for_100_ms_and_back_200_ms_after_light(
    clock: FakeClock, station_file: Path
) -> None:
    script = one(carried(7), 2.0, dark_s=(0.7, 1.3))
    bench = Bench(script, clock, lambda usb: LighthouseDriver(station_file, usb))
    with bench.driver:
        samples = bench.run_to(2.0)
    dark = [s for s in samples if 0.81 < s.time_s < 1.3]
    assert {(s.tracked, s.state) for s in dark} == {(False, TrackingState.OCCLUDED)}
    assert all(s.tracked for s in samples if s.time_s > 1.5)
    held = np.array([s.T_world_tracker.p for s in dark])
    assert np.ptp(held, axis=0).max() < 0.05, "it stays about where it was"


def test_a_tracker_that_lies_still_has_no_velocity(clock: FakeClock, station_file: Path) -> None:
    script = one(still(np.array([0.2, 0.9, 0.1]), np.array([0.2, 0.4, 0.1])), 1.5)
    bench = Bench(script, clock, lambda usb: LighthouseDriver(station_file, usb))
    with bench.driver:
        rest = [s for s in bench.run_to(1.5) if s.time_s > 1.0]
    assert len(rest) > 100
    assert all(s.velocity is not None and not s.velocity.any() for s in rest)
    p = np.array([s.T_world_tracker.p for s in rest])
    assert np.sqrt(p.var(axis=0).sum()) < 3e-4


def test_without_a_station_file_devices_are_calibrating_and_it_says_what_to_do(
    clock: FakeClock, tmp_path: Path
) -> None:
    bench = Bench(
        one(carried(1), 0.6), clock, lambda usb: LighthouseDriver(tmp_path / "none.json", usb)
    )
    with bench.driver:
        samples = bench.run_to(0.6)
        assert bench.words() == [FIRST_WORDS]
    assert {(s.tracked, s.state) for s in samples} == {(False, TrackingState.CALIBRATING)}
    assert all(s.T_world_tracker.p is None for s in samples)
    assert 4 <= len(samples) <= 7


def test_a_broken_station_file_is_told_at_opening(tmp_path: Path) -> None:
    path = tmp_path / "stations.json"
    path.write_text("{", encoding="utf-8")
    driver = LighthouseDriver(path, FakeTransport([HandedOut(one(carried(1), 0.1)[0])]))
    with pytest.raises(DriverUnavailable, match=r"stations\.json"):
        driver.open()


def test_devices_come_and_go_by_themselves(clock: FakeClock, station_file: Path) -> None:
    scripts = four(1.0)[2:]
    bench = Bench(scripts, clock, lambda usb: LighthouseDriver(station_file, usb))
    late, early = bench.devices
    late.unplug()
    with bench.driver as driver:
        assert {s.serial for s in bench.run_to(0.3)} == {TRACKER.serial}
        early.unplug()
        late.plug()
        wait_until(lambda: late.opened == 1, "the other is opened")
        samples = bench.run_to(0.8)
        gone = [s for s in samples if s.state is TrackingState.GONE]
        assert [s.serial for s in gone] == [TRACKER.serial]
        assert {s.serial for s in samples if s.tracked} == {"LHR-0000000R"}
        kinds = [(e.kind, e.serial) for e in driver.events() if e.serial]
        assert kinds == [(EventKind.GONE, TRACKER.serial)]
        early.plug()
        wait_until(lambda: early.opened == 1, "the first one is opened again")
        again = bench.run_to(1.4)
        assert any(s.serial == TRACKER.serial and s.tracked for s in again)
        assert EventKind.BACK in {e.kind for e in driver.events() if e.serial == TRACKER.serial}


def test_a_device_whose_interfaces_come_one_by_one_is_opened_with_all_of_them(
    clock: FakeClock, station_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(four(0.2)[2:], clock, lambda usb: LighthouseDriver(station_file, usb))
    late = bench.devices[0]
    late.unplug()
    opened: list[UsbDeviceInfo] = []
    claim, every = bench.transport.open, bench.transport.enumerate
    there = 0

    def one_more() -> list[UsbDeviceInfo]:
        nonlocal there
        there += late.plugged
        return [
            replace(i, interfaces=i.interfaces[:there]) if i.key == late.info.key else i
            for i in every()
        ]

    def noted(info: UsbDeviceInfo) -> FakeOpenDevice:
        opened.append(info)
        return claim(info)

    monkeypatch.setattr(bench.transport, "enumerate", one_more)
    monkeypatch.setattr(bench.transport, "open", noted)
    with bench.driver:
        late.plug()
        wait_until(lambda: late.opened == 1, "it is opened")
    assert opened[-1] == late.info
    assert len(opened) == 2


def test_after_a_return_times_go_on_from_sample_to_sample(
    clock: FakeClock, station_file: Path
) -> None:
    bench = Bench(one(carried(1), 1.0), clock, lambda usb: LighthouseDriver(station_file, usb))
    [device] = bench.devices
    with bench.driver:
        bench.run_to(0.4)
        device.unplug()
        wait_until(lambda: device.opened == 0, "it is let go of")
        bench.run_to(1.0)
        device.plug()
        wait_until(lambda: device.opened == 1, "it is opened again")
        times = [s.time_s for s in bench.run_to(1.8) if s.tracked and s.time_s > 0.5]
    assert len(times) > 100
    np.testing.assert_allclose(np.diff(times), 0.004, atol=1e-6)


def test_of_stations_that_are_named_one_after_the_other_the_newest_hold(
    clock: FakeClock, station_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the second are named while the session takes up the first."""
    newest, used = dict(STATIONS), list[tuple[Any, bool]]()
    bench = Bench(one(carried(1), 0.6), clock, lambda usb: LighthouseDriver(station_file, usb))

    def name_more(self: TrackedDevice, stations: Any, same_world: bool = True) -> None:
        used.append((stations, same_world))
        if stations is not newest:
            session.use_stations(newest, True)

    monkeypatch.setattr(TrackedDevice, "use_stations", name_more)
    with bench.driver as driver:
        bench.run_to(0.2)
        assert driver._hub is not None
        [session] = driver._hub._open()
        first = dict(STATIONS)
        session.use_stations(first, False)
        bench.run_to(0.4)
    assert [(stations is newest, same) for stations, same in used] == [(False, False), (True, True)]


def cable(kind: int, at: int, value: bytes) -> bytes:
    return (bytes([1, 0, kind]).ljust(at, b"\0") + value).ljust(64, b"\0")


def test_buttons_and_battery_are_told(clock: FakeClock, station_file: Path) -> None:
    bench = Bench(one(carried(1), 1.0), clock, lambda usb: LighthouseDriver(station_file, usb))
    [device] = bench.devices
    with bench.driver as driver:
        bench.run_to(0.2)
        device.put(cable(1, 8, (1 << 13 | 1).to_bytes(4, "little")), 2)
        device.put(cable(4, 14, bytes([0x80 | 74])), 2)
        bench.run_to(0.25)
        device.put(cable(1, 8, bytes(4)), 2)
        bench.run_to(0.3)
        told = [(e.kind, e.name) for e in driver.events() if e.serial == TRACKER.serial]
        [battery] = [d.battery for d in driver.devices() if d.serial == TRACKER.serial]
    down, up = EventKind.BUTTON_DOWN, EventKind.BUTTON_UP
    assert told == [(down, "system"), (down, "trigger"), (up, "system"), (up, "trigger")]
    assert battery == 0.74


def test_what_goes_wrong_with_one_device_is_told_once_and_the_rest_goes_on(
    clock: FakeClock, station_file: Path
) -> None:
    scripts = four(0.5)
    scripts[0].features[0x11] = [bytes([0x11, 20]) + bytes(62), bytes([0x11, 0])]
    scripts[1].features.clear()
    scripts[1].product = 0x2101
    scripts[2].product = 0x2345
    bench = Bench(scripts, clock, lambda usb: LighthouseDriver(station_file, usb))
    bench.devices[3].put(b"")
    bench.devices[3].put(bytes(range(64)))
    bench.devices[3].put(b"\x20\x01")
    with bench.driver:
        samples = bench.run_to(0.5)
        words = bench.words()
    assert {s.serial for s in samples if s.tracked} == {TRACKER.serial}
    assert len(words) == 3
    assert any("configuration" in w and "left out" in w for w in words)
    assert any("nothing is switched on" in w for w in words)
    assert any("unknown kind" in w for w in words)
    assert not bench.devices[2].answers.sent, "nobody knows what it would make of it"


def test_where_nothing_is_plugged_in_or_all_is_taken_it_says_so(station_file: Path) -> None:
    with pytest.raises(TrackerNotFound, match="Plug in"):
        LighthouseDriver(station_file, FakeTransport([])).open()
    taken = HandedOut(one(carried(1), 0.1)[0])
    taken.refusal = DeviceBusy("SteamVR has it")
    with pytest.raises(DeviceBusy):
        LighthouseDriver(station_file, FakeTransport([taken])).open()


def test_a_way_to_usb_that_does_not_exist_is_told_before_anything_is_opened() -> None:
    with pytest.raises(ValueError, match=r"transport=foo: here there are .*pyusb"):
        load_driver("lighthouse:transport=foo")


def test_ctrl_c_while_the_second_device_is_opened_leaves_none_open(
    clock: FakeClock, station_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(
        four(0.1), clock, lambda usb: LighthouseDriver(station_file, usb, tmp_path / "raw.pcap")
    )
    claim = bench.transport.open

    def interrupted(info: UsbDeviceInfo) -> FakeOpenDevice:
        if bench.devices[0].opened:
            raise KeyboardInterrupt
        return claim(info)

    monkeypatch.setattr(bench.transport, "open", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.driver.open()
    assert not any(device.opened for device in bench.devices)
    assert bench.driver._raw is None


def test_all_devices_are_told_to_stop_before_any_is_waited_for(
    clock: FakeClock, station_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    stop, close = DeviceSession.stop, DeviceSession.close

    def noted(word: str, do: Callable[..., None]) -> Callable[..., None]:
        def call(*args: Any) -> None:
            told.append(word)
            do(*args)

        return call

    bench = Bench(four(0.1), clock, lambda usb: LighthouseDriver(station_file, usb))
    with bench.driver:
        monkeypatch.setattr(DeviceSession, "stop", noted("stop", stop))
        monkeypatch.setattr(DeviceSession, "close", noted("wait", close))
    assert told[:5] == ["stop"] * 4 + ["wait"]


def test_while_steamvr_runs_nothing_is_touched(
    station_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver_module, "steamvr_runs", lambda: True)
    with pytest.raises(DeviceBusy, match="openvr"):
        LighthouseDriver(station_file).open()


@pytest.mark.skipif(sys.platform == "win32", reason="processes are files elsewhere")
def test_steamvr_is_found_among_the_processes(tmp_path: Path) -> None:
    for pid, name in (("12", "bash"), ("13", "vrmonitor")):
        (tmp_path / pid).mkdir()
        (tmp_path / pid / "comm").write_text(f"{name}\n", encoding="utf-8")
    assert not steamvr_runs(tmp_path)
    (tmp_path / "13" / "comm").write_text("vrserver\n", encoding="utf-8")
    assert steamvr_runs(tmp_path)


def test_what_is_sent_to_a_device_is_its_light_mode_and_nothing_else(
    clock: FakeClock, station_file: Path
) -> None:
    bench = Bench(one(carried(1), 0.3), clock, lambda usb: LighthouseDriver(station_file, usb))
    with bench.driver:
        bench.run_to(0.3)
    assert bench.devices[0].answers.sent == [bytes([4, 1, 0, 0, 0]), bytes([7, 3, 0, 0, 0])]


S = 48_000_000


def test_a_cable_in_the_light_of_gen2_stations_switches_the_mode_once() -> None:
    mode = LightMode(gen2=False, has_choice=True, tells=True)
    assert not any(mode.switch(k * S // 10, 0, False) for k in range(300)), "in the dark it waits"
    assert mode.switch(31 * S, 0, True)
    assert mode.gen2
    assert not any(mode.switch(31 * S + k * S // 10, 5, False) for k in range(100))


def test_by_radio_one_mode_after_the_other_is_tried_until_light_makes_sense() -> None:
    mode = LightMode(gen2=False, has_choice=True, tells=False)
    changes = [k for k in range(400) if mode.switch(k * S // 10, 0, False)]
    assert 5 < len(changes) < 10
    assert np.all(np.diff(changes) <= 81)
    was = mode.gen2
    assert not any(mode.switch(40 * S + k * S // 10, 3, False) for k in range(600))
    assert mode.gen2 is was


@pytest.mark.parametrize("gap_s", [-30, 1, 20, 89])
@pytest.mark.parametrize("tells", [False, True])
def test_a_clock_that_jumps_when_the_mode_changes_is_no_wait_in_vain(
    gap_s: int, tells: bool
) -> None:
    mode = LightMode(gen2=False, has_choice=True, tells=tells)
    times = [40 * S + k * S // 10 for k in range(100)]
    changed = next(t for t in times if mode.switch(t, 0, sees_gen2=t > 41 * S))
    after = [changed + gap_s * S + k * S // 10 for k in range(8)]
    assert not any(mode.switch(t, 0, False) for t in after), "light needs a moment to come"
    assert mode.gen2


def test_a_device_of_the_first_generation_is_left_in_its_mode() -> None:
    mode = LightMode(gen2=False, has_choice=False, tells=False)
    assert not any(mode.switch(k * S, 0, True) for k in range(100))


def test_a_fault_in_following_one_device_is_told_once_and_leaves_the_others(
    clock: FakeClock, station_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    feed = TrackedDevice.feed

    def faulty(self: TrackedDevice, report: bytes) -> None:
        if self.model.serial == "LHR-0000000R":
            raise ZeroDivisionError("made up")
        feed(self, report)

    monkeypatch.setattr(TrackedDevice, "feed", faulty)
    bench = Bench(four(0.6)[2:], clock, lambda usb: LighthouseDriver(station_file, usb))
    with bench.driver:
        samples = bench.run_to(0.6)
        words = bench.words()
    assert {s.serial for s in samples if s.tracked} == {TRACKER.serial}
    assert sum("ZeroDivisionError" in w for w in words) == 1


def test_a_dongle_is_asked_until_something_is_switched_on_behind_it(
    clock: FakeClock, station_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(device_session, "RETRY_S", 0.01)
    [script] = one(carried(1), 0.3)
    script.product = 0x2101
    bench = Bench([script], clock, lambda usb: LighthouseDriver(station_file, usb))
    bench.devices[0].answers.stalled.add(0x10)
    with bench.driver as driver:
        bench.run_to(0.1)
        assert [w for w in bench.words() if "nothing is switched on" in w]
        assert not [d for d in driver.devices() if d.kind == "tracker"]
        bench.devices[0].answers.stalled.clear()
        wait_until(lambda: any(d.kind == "tracker" for d in driver.devices()), "it is there")
    assert bench.devices[0].answers.sent[:1] == [
        bytes.fromhex("ff9610be5b325411cf8375538a086a5358d0b1")
    ]
