"""The driver to copy: trackers that send lines of text, by UDP or on a serial line.

It is a real one, for receivers of one's own making (ESP32, Arduino, a script):

    lobstr-live --driver sample                                      (UDP port 9001, this machine)
    lobstr-live --driver sample:port=/dev/ttyUSB0,fields=serial,qw,qx,qy,qz,ms

A line of the first reads ``HIP 0.10 0.95 0.02 0 0 0 1``. docs/writing-a-driver.md walks through
this file; its steps are marked here.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from lobstr_hw.drivers.driver import DeviceInfo, Probe
from lobstr_hw.drivers.reading_thread import Reading
from lobstr_hw.drivers.serial_stream import SerialLink
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.drivers.udp_port import UdpPort
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array, from_quat_xyzw
from lobstr_hw.trackers import TrackingState

__all__ = ["LineRecord", "SampleDriver", "field_names", "parse_line"]

# Step 1: what the device says, as one frozen value


@dataclass(frozen=True, slots=True, eq=False)
class LineRecord:
    """One line.

    Attributes:
        serial: of the tracker.
        p: (3,) metres, or None: the device knows only how it is turned.
        quat_xyzw: (4,), of length 1 or nearly so.
        time_s: of the device's own clock, where it sends it.
    """

    serial: str
    p: Array | None
    quat_xyzw: Array
    time_s: float | None


# Step 2: a pure function from bytes to that value, layout drawn above it; None for anything else
#
#   fields, by spaces, tabs, commas or semicolons:
#   serial | x y z metres | qx qy qz qw | ms of the device's clock | _ is skipped

POSITION, ROTATION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
FIELDS = ("serial", *POSITION, *ROTATION)
KNOWN = frozenset({*FIELDS, "ms", "_"})
SEPARATORS = str.maketrans(",;\t", "   ")
FARTHEST_M = 1000.0
LONGEST_SERIAL = 64


def field_names(text: str) -> tuple[str, ...]:
    """``serial,x,y,z,...`` -> the names.

    Raises:
        ValueError: a name that is not known, one that is there twice, or a pose in part.
    """
    names = tuple(text.split(","))
    twice = any(name != "_" and names.count(name) > 1 for name in names)
    whole = set(ROTATION) <= set(names) and len(set(POSITION) & set(names)) in (0, 3)
    if twice or not whole or not set(names) <= KNOWN:
        raise ValueError(f"{text!r}: once each qx,qy,qz,qw; x,y,z or none; of serial, ms; any _")
    return names


def parse_line(line: bytes, fields: Sequence[str] = FIELDS) -> LineRecord | None:
    """One line -> what it says, or None when it is broken."""
    try:
        words = line.decode("utf-8").translate(SEPARATORS).split()
        values = dict(zip(fields, words, strict=True))
        quat = np.array([float(values[name]) for name in ROTATION])
        p = np.array([float(values[name]) for name in POSITION if name in values])
        time_s = float(values["ms"]) * 1e-3 if "ms" in values else None
    except ValueError:  # not UTF-8, too few or too many words, not a number
        return None
    serial = values.get("serial", "SAMPLE")
    if not _believable(serial, quat, p, time_s):
        return None
    return LineRecord(serial, p if len(p) == 3 else None, quat, time_s)


def _believable(serial: str, quat: Array, p: Array, time_s: float | None) -> bool:
    """Text can say anything: infinity, not a number, a quaternion of zeros."""
    good_time = time_s is None or math.isfinite(time_s)
    good_pose = bool(np.all(np.abs(p) < FARTHEST_M)) and 0.5 < float(np.linalg.norm(quat)) < 2.0
    return good_time and good_pose and serial.isprintable() and len(serial) <= LONGEST_SERIAL


# Step 3: the open device: bytes in, readings out; waits 0.1 s at most


class Link(Protocol):
    """What UdpPort and SerialLink have in common."""

    def read(self) -> bytes:
        """What has come in; waits 0.05 s at most."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


LONGEST_LINE = 1024


class _Lines:
    """Cuts lines from what comes in."""

    def __init__(self, link: Link, whole: bool, fields: Sequence[str]) -> None:
        self._link, self._whole, self._fields = link, whole, fields
        self._rest = b""

    def read(self) -> list[Reading]:
        data = self._rest + self._link.read() + (b"\n" if self._whole else b"")
        *lines, rest = data.split(b"\n")
        self._rest = rest[-LONGEST_LINE:]  # a device that never ends its line must not fill memory
        records = [parse_line(line, self._fields) for line in lines]
        return [_reading(record) for record in records if record is not None]

    def close(self) -> None:
        self._link.close()


def _reading(record: LineRecord) -> Reading:
    """Into our world (docs/conventions.md). These devices are asked to use it already."""
    pose = PartialPose(from_quat_xyzw(record.quat_xyzw), record.p)
    state = TrackingState.INERTIAL if record.p is None else TrackingState.OK
    return Reading(record.serial, pose, state, record.time_s)


# Step 4: the driver: options, probe, how to connect, what a tracker is; the rest is inherited


class SampleDriver(StreamDriver):
    """Every tracker that a line names."""

    options: ClassVar[Mapping[str, Callable[[str], object]]] = {
        "port": str,
        "bind": str,
        "baud": int,
        "fields": field_names,
    }
    """What ``--driver sample:...`` understands, and how it is read."""

    def __init__(
        self,
        port: str = "9001",
        bind: str = "127.0.0.1",
        baud: int = 115200,
        fields: Sequence[str] = FIELDS,
    ) -> None:
        """Choose where to listen.

        Args:
            port: a number: of UDP; else a serial line.
            bind: address of this machine, for UDP; 0.0.0.0 for all, so that others can send.
            baud: of the serial line.
            fields: what stands in a line, in order.
        """
        super().__init__()
        if port.isdecimal() and not 0 < int(port) < 65536:
            raise ValueError(f"port={port} is not between 1 and 65535")
        self._port, self._bind, self._baud, self._fields = port, bind, baud, tuple(fields)

    @classmethod
    def probe(cls) -> Probe:
        """By UDP it needs nothing."""
        return Probe(available=True)

    def _connect(self) -> _Lines:
        if self._port.isdecimal():
            return _Lines(UdpPort(self._bind, int(self._port)), True, self._fields)
        return _Lines(SerialLink(self._port, self._baud), False, self._fields)

    def _info(self, serial: str) -> DeviceInfo:
        return DeviceInfo(serial, "tracker", "lines of text")
