"""How fast Lighthouse recordings are decoded and tracked, and what three trackers cost live."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S
from lobstr_hw.drivers.lighthouse.decoding import DeviceDecoder
from lobstr_hw.drivers.lighthouse.device_reader import DeviceReader
from lobstr_hw.drivers.lighthouse.made_room import made_device, made_reports, made_stations
from lobstr_hw.drivers.lighthouse.recorded_tracking import read_takes, solve_takes, track_takes
from lobstr_hw.drivers.lighthouse.station_file import load_stations
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.runtime.clock import HostClock

__all__ = ["HEAD", "Live", "Run", "measure", "measure_live", "yardstick"]

HEAD = (
    "| recording | devices | stations | seconds | events | decoded/s | tracked/s |"
    " a device, % of a core | in yardsticks |\n|---|---|---|---|---|---|---|---|---|"
)
DEVICES = 3
PACE_S = 0.011
"""How often a loop at 90 Hz looks what came."""
YARDSTICK_PRODUCTS = 20_000


@dataclass(frozen=True, slots=True)
class Run:
    """One recording.

    Attributes:
        name: of the file.
        devices, stations: that were tracked, and by how many.
        seconds: of all devices together.
        events: IMU samples, pulses, syncs and sweeps.
        decode_s: CPU time from the file to angles.
        track_s: CPU time from the file to poses, in batches as live.
        yardstick_s: CPU time of the yardstick, before and after.
    """

    name: str
    devices: int
    stations: int
    seconds: float
    events: int
    decode_s: float
    track_s: float
    yardstick_s: float

    @property
    def share(self) -> float:
        """Of one core, for one device in real time."""
        return self.track_s / self.seconds

    def line(self) -> str:
        """A row of the table."""
        return (
            f"| {self.name} | {self.devices} | {self.stations} | {self.seconds:.1f} |"
            f" {self.events} | {self.events / self.decode_s:,.0f} |"
            f" {self.events / self.track_s:,.0f} | {100 * self.share:.1f} |"
            f" {self.share / self.yardstick_s:.2f} |"
        )

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self) | {"share_of_a_core": self.share}


@dataclass(frozen=True, slots=True)
class Live:
    """Three trackers with two stations, fed as fast as they would send.

    Attributes:
        seconds: of it.
        paced: share of one core.
        unpaced: the same when fed without a pause.
        late: share of the looks that came late: the machine is busy.
        yardstick_s: CPU time of the yardstick, before and after.
    """

    seconds: float
    paced: float
    unpaced: float
    late: float
    yardstick_s: float

    def line(self) -> str:
        """In words."""
        return (
            f"three trackers with two base stations in real time: {100 * self.paced:.1f} % of one "
            f"core ({100 * self.unpaced:.1f} % when fed without a pause; yardstick "
            f"{1e3 * self.yardstick_s:.1f} ms, {100 * self.late:.0f} % of the looks late)"
        )

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def yardstick() -> float:
    """CPU seconds of a fixed piece of work of the same kind: small products in numpy."""
    begun = time.process_time()
    a, turn = np.eye(3), np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    for _ in range(YARDSTICK_PRODUCTS):
        a = a @ turn
    return time.process_time() - begun


def measure(files: Sequence[Path], stations: Path | None, seconds: float) -> Iterator[Run]:
    """The made room, then each recording.

    Raises:
        FileFormatError, StationsNotSolved: as ``lobstr-log import``.
    """
    yield _made(seconds)
    for path in files:
        yield _recorded(path, stations)


def _recorded(path: Path, stations: Path | None) -> Run:
    before, begun = yardstick(), time.process_time()
    takes = read_takes(path)
    decode_s = time.process_time() - begun
    known = load_stations(stations) if stations else solve_takes(takes).stations
    begun = time.process_time()
    track_takes(takes, known)
    track_s = time.process_time() - begun
    seconds = sum(float(np.median(np.diff(t.take.imu.ticks))) * len(t.take.imu) for t in takes)
    events = sum(len(t.recording.events) for t in takes)
    middle = (before + yardstick()) / 2
    return Run(
        path.name, len(takes), len(known), seconds / TICKS_PER_S, events, decode_s, track_s, middle
    )


def _made(seconds: float) -> Run:
    reports = [made_reports(seconds, nth) for nth in range(DEVICES)]
    before, begun, events = yardstick(), time.process_time(), 0
    for of_one in reports:
        reader = DeviceReader(old_radio=False, gen2_light=True)
        for data in of_one:
            reader.feed(data)
        batch = reader.take()
        DeviceDecoder(made_device("")).decode(batch)
        events += len(batch)
    decode_s = time.process_time() - begun
    begun = time.process_time()
    for device, of_one in zip(_tracked(), reports, strict=True):
        for data in of_one:
            device.feed(data)
    track_s = time.process_time() - begun
    middle = (before + yardstick()) / 2
    name, stations = "made-up room", len(made_stations())
    return Run(name, DEVICES, stations, DEVICES * seconds, events, decode_s, track_s, middle)


def _tracked() -> list[TrackedDevice]:
    devices = [TrackedDevice(made_device(f"made-{nth}"), made_stations()) for nth in range(DEVICES)]
    for device in devices:
        device.decoded = None
    return devices


def measure_live(seconds: float) -> Live:
    """Feed three trackers at their own speed, the search for their first pose included."""
    reports = [made_reports(seconds, nth) for nth in range(DEVICES)]
    before = yardstick()
    paced, late = _feed(reports, seconds, PACE_S)
    unpaced, _ = _feed(reports, seconds, 0.0)
    return Live(seconds, paced, unpaced, late, (before + yardstick()) / 2)


def _feed(reports: Sequence[Sequence[bytes]], seconds: float, pace_s: float) -> tuple[float, float]:
    """CPU seconds for a second of data, and the share of late looks; pace 0: without a pause."""
    devices, looks, late = _tracked(), int(seconds / PACE_S), 0
    at = [0] * len(reports)
    clock, cpu = HostClock(), time.process_time()
    begun_s = clock.now_s()
    for look in range(1, looks + 1):
        for k, device in enumerate(devices):
            until = len(reports[k]) * look // looks
            for data in reports[k][at[k] : until]:
                device.feed(data)
            device.poses()
            at[k] = until
        wait_s = begun_s + look * pace_s - clock.now_s()
        if pace_s > 0.0 and wait_s > 0.0:
            clock.sleep(wait_s)
        late += wait_s < 0.0
    return (time.process_time() - cpu) / seconds, late / looks
