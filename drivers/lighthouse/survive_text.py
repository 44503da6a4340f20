"""Text recordings of libsurvive -> the raw events of its devices.

A line: seconds, device, what, fields. Those that matter here (times are 32 bits of ticks):

    CONFIG json                          IMU_SCALES gyro acc     (codes, as in imu.py)
    i mask time ax ay az gx gy gz ...    C port time length      (Gen1 pulse)
    Y channel time bit g                 W channel sensor time half   (Gen2; a row of the model)
"""

import gzip
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.drivers.lighthouse.capture_clock import CaptureClock
from lobstr_hw.drivers.lighthouse.capture_stream import LONGEST, open_capture
from lobstr_hw.drivers.lighthouse.device_config import parse_config
from lobstr_hw.drivers.lighthouse.imu import RANGES, ImuRanges, parse_ranges
from lobstr_hw.drivers.lighthouse.raw_events import EventLists
from lobstr_hw.drivers.lighthouse.ticks import Ticks
from lobstr_hw.errors import FileFormatError

__all__ = ["RecordedDevice", "read_survive_text"]

CHUNK = 1 << 16
COUNTS = 6
MOST_DEVICES = 64
LARGEST = 1 << 31


@dataclass(slots=True)
class RecordedDevice:
    """One device of a recording.

    Attributes:
        model: from its CONFIG, or None: without one its Gen2 sweeps are lost.
        ranges: of its IMU, or None: not told.
        lists: its events.
        problem: what was wrong with its configuration, or empty.
        clock: its time beside the recording's.
    """

    model: DeviceModel | None = None
    ranges: ImuRanges | None = None
    lists: EventLists = field(default_factory=EventLists)
    problem: str = ""
    ticks: Ticks = field(default_factory=Ticks)
    clock: CaptureClock = field(default_factory=CaptureClock)

    def read(self, time_s: float, what: str, fields: str) -> None:
        """One line; ValueError, IndexError: it is damaged."""
        if what == "CONFIG":
            self._configure(fields)
            return
        if what not in ("IMU_SCALES", "i", "C", "Y", "W"):
            return
        numbers = [_whole(number) for number in fields.split()[: 2 + COUNTS]]
        match what:
            case "IMU_SCALES":
                self.ranges = parse_ranges(bytes([RANGES, numbers[0] & 0xFF, numbers[1] & 0xFF]))
            case "i":
                self._imu(time_s, numbers)
            case _:
                self._light(what, numbers)

    def _configure(self, text: str) -> None:
        try:
            self.model, self.problem = parse_config(text), ""
        except FileFormatError as error:
            self.problem = str(error)

    def _imu(self, time_s: float, numbers: list[int]) -> None:
        _, time, *counts = numbers
        if len(counts) != COUNTS or max(map(abs, counts)) > LARGEST:
            raise ValueError(f"six counts of an IMU are not {counts}")
        ticks = self.ticks.imu(time & 0xFFFFFFFF)
        self.lists.imu.append((ticks, *counts))
        self.clock.observe(ticks, time_s)

    def _light(self, what: str, numbers: list[int]) -> None:
        time = numbers[1 if what in "CY" else 2]
        ticks = self.ticks.light(time & 0xFFFFFFFF, 32)
        if ticks is None:
            return
        if what == "C":
            self.lists.pulses.append((numbers[0] & 0xFF, ticks, numbers[2] & 0xFFFF))
        elif what == "Y":
            channel, _, bit, g = numbers[:4]
            self.lists.syncs.append((channel & 0xF, ticks, bit & 1, g & 1))
        elif self.model is not None and 0 <= numbers[1] < len(self.model.ports):
            port = int(self.model.ports[numbers[1]])
            self.lists.add_sweep((numbers[0] & 0xF, port, ticks, numbers[3] & 1))


def read_survive_text(path: Path) -> dict[str, RecordedDevice]:
    """The devices of a recording by the names it gives them; a cut or damaged file gives the rest.

    Raises:
        FileFormatError: it cannot be read, or holds no line of a device.
    """
    devices: dict[str, RecordedDevice] = {}
    with open_capture(path) as stream:
        for line in _lines(stream):
            parts = line.split(None, 3)
            if len(parts) < 4 or (parts[1] not in devices and len(devices) >= MOST_DEVICES):
                continue
            try:
                devices.setdefault(parts[1], RecordedDevice()).read(_seconds(parts[0]), *parts[2:])
            except (ValueError, IndexError, OverflowError):
                continue  # the last line of a cut file, or a damaged one
    found = {name: d for name, d in devices.items() if d.model or d.lists.imu}
    if not found:
        raise FileFormatError(f"{path}: no line of a device in it; is this a libsurvive recording?")
    return found


def _lines(stream: IO[bytes]) -> Iterator[str]:
    """Lines until the end, or until the compressed stream breaks."""
    rest = b""
    while True:
        try:
            chunk = stream.read(CHUNK)
        except (EOFError, zlib.error, gzip.BadGzipFile):
            return
        *lines, rest = (rest + chunk).split(b"\n")
        yield from (line.decode("utf-8", "replace") for line in lines)
        if not chunk or len(rest) > LONGEST:
            return


def _seconds(text: str) -> float:
    time_s = float(text)
    if not abs(time_s) < LARGEST:
        raise ValueError(f"{text} is no time")
    return time_s


def _whole(text: str) -> int:
    return int(float(text)) if "." in text or "e" in text else int(text)
