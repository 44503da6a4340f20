"""Captures of real devices, played to the driver by the fake bus (LOBSTR_DATA names the folder)."""

import os
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.captured_usb import devices_of_capture
from support.fake_clock import FakeClock
from support.lighthouse_devices import Bench

from lobstr_hw.drivers import reading_thread, stream
from lobstr_hw.drivers.driver import EventKind
from lobstr_hw.drivers.lighthouse.angles import StationCalibration
from lobstr_hw.drivers.lighthouse.decoding import DeviceDecoder
from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.lighthouse.light import Stations, join_angles
from lobstr_hw.drivers.lighthouse.recordings import DeviceRecording, read_recording
from lobstr_hw.drivers.lighthouse.station_file import load_stations, save_stations
from lobstr_hw.drivers.lighthouse.station_solve import solve_stations
from lobstr_hw.drivers.lighthouse.station_views import Take
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.trackers import TrackingState

BUTTONS = {"trigger", "grip", "menu", "system"}


@pytest.fixture(scope="module")
def captures() -> Path:
    named = os.environ.get("LOBSTR_DATA")
    if named is None or not (Path(named) / "lighthouse" / "usbmon").is_dir():
        pytest.skip("set LOBSTR_DATA to the folder that holds lighthouse/ to run this")
    return Path(named) / "lighthouse" / "usbmon"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    made = FakeClock(0.0)
    monkeypatch.setattr(stream, "perf_counter", made.now_s)
    monkeypatch.setattr(reading_thread, "perf_counter", made.now_s)
    return made


def played(path: Path, clock: FakeClock, stations: Path | None = None) -> Bench:
    scripts = devices_of_capture(path, after_config=True)
    return Bench(scripts, clock, lambda usb: LighthouseDriver(stations, usb))


def solved(devices: list[DeviceRecording], path: Path) -> Stations:
    takes: list[Take] = []
    calibrations: dict[int, StationCalibration] = {}
    for device in devices:
        if device.model is not None:
            decoded = DeviceDecoder(device.model, device.ranges).decode(device.events)
            takes.append(Take(device.model, decoded.imu, join_angles([decoded.angles])))
            calibrations |= decoded.stations
    solution = solve_stations(takes, calibrations, at_most=12)
    save_stations(path, solution.stations, solution.residual_rad)
    return load_stations(path)


def test_an_index_headset_gives_the_poses_of_its_file_at_once_and_bit_for_bit(
    captures: Path, clock: FakeClock, tmp_path: Path
) -> None:
    path = captures / "vive-index-cal.pcap.gz"
    devices = read_recording(path)
    stations = solved(devices, tmp_path / "stations.json")
    bench = played(path, clock, tmp_path / "stations.json")
    with bench.driver as driver:
        samples = [s for s in bench.run_to(3.0) if s.T_world_tracker.p is not None]
        [headset] = [d for d in driver.devices() if d.kind == "headset"]
        [session] = driver._hub._sessions.values()  # type: ignore[union-attr]
        assert session.about is not None
        tracked = TrackedDevice(session.about.model, stations, session.about.ranges)
    for time_s, _, data in bench.devices[0].script.reports:
        if time_s - bench.devices[0].script.reports[0][0] <= 3.0:
            tracked.feed(data)
    poses = tracked.poses()
    assert len(samples) > 2000
    found = np.array([s.T_world_tracker.p for s in samples])
    np.testing.assert_array_equal(found, poses.p[: len(found)])
    np.testing.assert_array_equal([s.T_world_tracker.R for s in samples], poses.R[: len(found)])
    assert samples[0].time_s < 2.0, "tracked within two seconds of light"
    assert all(s.state is TrackingState.OK for s in samples)
    assert (headset.serial, headset.model, headset.role_hint) == ("LHR-DFCF00EE", "Utah MP", "head")
    assert headset.stations_in_view == 2
    still = np.array([s.T_world_tracker.p for s in samples if s.time_s > 2.0])
    assert np.sqrt(still.var(axis=0).sum()) < 3e-4


def test_a_trackers_button_by_cable_is_its_system_button(captures: Path, clock: FakeClock) -> None:
    for name in ("tracker-gen1-wired-buttons", "tracker-gen2-wired-buttons"):
        bench = played(captures / f"{name}.pcap.gz", clock)
        with bench.driver as driver:
            bench.run_to(clock.now_s() + 15.0, 0.1)
            told = [(e.kind, e.name) for e in driver.events() if e.name in BUTTONS]
            [battery] = [d.battery for d in driver.devices() if d.kind == "tracker"]
        assert told == [(EventKind.BUTTON_DOWN, "system"), (EventKind.BUTTON_UP, "system")]
        assert battery in (0.74, 0.91)


def test_every_button_of_a_wand_is_told_by_radio(captures: Path, clock: FakeClock) -> None:
    bench = played(captures / "wand-all-buttons.pcap.gz", clock)
    with bench.driver as driver:
        bench.run_to(40.0, 0.2)
        told = [(e.kind, e.name) for e in driver.events() if e.name in BUTTONS]
    down = [name for kind, name in told if kind is EventKind.BUTTON_DOWN]
    up = [name for kind, name in told if kind is EventKind.BUTTON_UP]
    assert set(down) == BUTTONS
    assert sorted(down) == sorted(up)


def test_a_dongle_with_nothing_behind_it_is_told_once(captures: Path, clock: FakeClock) -> None:
    bench = played(captures / "WM1-wand.pcap.gz", clock)
    with bench.driver as driver:
        bench.run_to(0.5, 0.1)
        words = bench.words()
        kinds = {d.serial: d.kind for d in driver.devices()}
        batteries = {d.serial: d.battery for d in driver.devices()}
    assert sum("nothing is switched on" in w for w in words) == 1
    assert kinds == {
        "LHR-D8EC5307": "headset",
        "LHR-FFFFFB45": "controller",
        "LHR-EA80BDA9": "controller",
    }
    assert batteries["LHR-EA80BDA9"] == 0.94
