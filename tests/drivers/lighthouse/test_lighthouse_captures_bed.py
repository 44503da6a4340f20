"""What devices say on USB, through the real libraries, against what is on file: reports and poses.

The test of the driver runs this file again in the bed, with what is inside.
"""

import ctypes.util
import importlib.util
import os
import threading
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from lighthouse_usb import measure
from support.beds import need
from support.lighthouse_bed import ENVIRONMENT, RemoteBed, use_system_libusb
from support.lighthouse_devices import named, scripted_device
from support.lighthouse_room import carried, room
from support.lighthouse_wire import reports_of
from support.scripted_usb import save_script
from support.umockdev_beds import run_in_bed

from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.lighthouse.station_file import load_stations, save_stations
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.transports import TRANSPORTS
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import TrackingState

SMALL_CAPTURES = ("tracker-gen1-wired-buttons", "tracker-gen2-wired-buttons", "wand-all-buttons")
NAMES = [transport.name for transport in TRANSPORTS]
PATIENCE_S = 90.0
SECONDS = 1.0
STATIONS, MODEL = room(2), named("LHR-00000001")
REPORTS = reports_of(STATIONS, MODEL, carried(1), SECONDS)
STATION_FILE = "LOBSTR_STATION_FILE"


def need_the_bed() -> None:
    for module in ("hidraw", "usb"):
        present = importlib.util.find_spec(module) is not None
        need(f"the Python package of {module}", "pip install 'lobstr-hw[lighthouse]'", present)
    libusb = ctypes.util.find_library("usb-1.0")
    need("libusb", "apt-get install libusb-1.0-0", libusb is not None)


def poses_on_file(stations: Path) -> Array:
    """(k, 3) every tracked position that follows from the reports in their order."""
    tracked = TrackedDevice(MODEL, load_stations(stations))
    for report in REPORTS:
        tracked.feed(report.data)
    poses = tracked.poses()
    return poses.p[poses.tracked]


def poses_of_driver(driver: LighthouseDriver, bed: RemoteBed, count: int) -> Array:
    """(k, 3) every tracked position that the driver gives, until there are so many."""
    found: list[Array] = []
    played, end_s = 0, time.perf_counter() + PATIENCE_S
    while len(found) < count and time.perf_counter() < end_s:
        if played < len(REPORTS) and bed.sent() and not bed.waiting():
            bed.play(4)
            played += 4
        for sample in driver.poll(time.perf_counter()):
            if sample.tracked and sample.state is TrackingState.OK:
                assert sample.T_world_tracker.p is not None
                found.append(sample.T_world_tracker.p)
        time.sleep(0.002)
    return np.array(found)


if ENVIRONMENT in os.environ:
    use_system_libusb()

    @pytest.mark.bed
    @pytest.mark.parametrize("transport", NAMES)
    def test_the_driver_gives_the_poses_of_the_file_each_time_it_is_plugged_in(
        transport: str,
    ) -> None:
        stations = Path(os.environ[STATION_FILE])
        expected = poses_on_file(stations)
        assert len(expected) > 100
        bed = RemoteBed()
        with LighthouseDriver(stations, transport) as driver:
            for _ in range(2):
                found = poses_of_driver(driver, bed, len(expected))
                np.testing.assert_array_equal(found, expected)
                bed.unplug()
                bed.plug()
        bed.close()
        assert [t.name for t in threading.enumerate() if t.name.startswith("lobstr")] == []

else:

    @pytest.mark.bed
    def test_the_driver_gives_the_poses_of_the_file(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        need_the_bed()
        script, stations = tmp_path / "script.json", tmp_path / "stations.json"
        save_script([scripted_device(MODEL, REPORTS)], script)
        save_stations(stations, STATIONS, {})
        monkeypatch.setenv(STATION_FILE, str(stations))
        run_in_bed("lighthouse_testbed.py", [str(script)], Path(__file__))

    @pytest.mark.bed
    @pytest.mark.parametrize("name", SMALL_CAPTURES)
    def test_a_capture_comes_byte_for_byte_and_hit_for_hit(name: str) -> None:
        folder = os.environ.get("LOBSTR_DATA")
        if folder is None or not (Path(folder) / "lighthouse").is_dir():
            pytest.skip("set LOBSTR_DATA to the folder that holds lighthouse/ to run this")
        need_the_bed()
        path = Path(folder) / "lighthouse" / "usbmon" / f"{name}.pcap.gz"
        row = measure(path, NAMES, solve=False)
        assert {read.transport for read in row.reads} == set(NAMES)
        for read in row.reads:
            assert read.reports > 1000
            assert (read.equal, read.config) == (read.reports, True)
        assert row.apart == 0.0
