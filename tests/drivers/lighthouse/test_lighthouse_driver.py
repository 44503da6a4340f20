"""The driver in a made-up room: devices on a fake bus, time in the test's hands."""

from pathlib import Path
from time import perf_counter

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.fake_transport import FakeTransport
from support.lighthouse_devices import HandedOut, named, scripted_device
from support.lighthouse_room import carried, room
from support.lighthouse_wire import TimedReport, reports_of
from support.scripted_usb import ScriptedDevice
from support.stream_contract import Sent, StreamDriverContract

from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.lighthouse import hub, tracked_device
from lobstr_hw.drivers.lighthouse.device_follower import About, DeviceFollower
from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.lighthouse.light_mode import LightMode
from lobstr_hw.drivers.lighthouse.sight import Sight
from lobstr_hw.drivers.lighthouse.station_file import save_stations
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.transport import RawReport
from lobstr_hw.drivers.reading_thread import Reading

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
        return LighthouseDriver(self.file, self.transport)

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
            self.play(self._first)
        self._opened = count

    def _now_s(self) -> float:
        return perf_counter()


class TestContract(StreamDriverContract):
    @pytest.fixture
    def bed(self, station_file: Path, monkeypatch: pytest.MonkeyPatch) -> OneTracker:
        monkeypatch.setattr(hub, "LOOK_S", 0.01)
        monkeypatch.setattr(tracked_device, "STEP", 1)  # every sample at once
        return OneTracker(station_file)
