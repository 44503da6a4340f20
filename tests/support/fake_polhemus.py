"""A Polhemus tracker that obeys the real commands, one station per sensor plugged in."""

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from support.serial_bed import SerialDevice

from lobstr_hw.drivers.polhemus_records import PolhemusModel
from lobstr_hw.rotations import from_rotation_vector, to_quat_xyzw

__all__ = ["FakePolhemus", "fastrak_record", "liberty_record", "quat_at", "source_position"]

RATE_HZ = 60.0
Array = NDArray[np.float64]


def source_position(station: int, time_s: float) -> Array:
    """Where a sensor is, inches in the source's frame; nowhere twice."""
    return np.array([20.0 + 3.0 * time_s, 5.0 * station, -10.0 + np.sin(time_s)])


def quat_at(station: int, time_s: float) -> Array:
    """How it is turned, w x y z, sensor to source."""
    return np.roll(to_quat_xyzw(from_rotation_vector(np.array([0.3, time_s, 0.2 * station]))), 1)


def fastrak_record(station: int, p_inches: Array, quat_wxyz: Array, status: bytes = b" ") -> bytes:
    """32 bytes, written out apart from the parser's table."""
    head = b"0" + str(station).encode() + status
    return head + struct.pack("<7f", *p_inches, *quat_wxyz) + b" "


def liberty_record(
    station: int,
    p_inches: Array,
    quat_wxyz: Array,
    time_ms: int = 0,
    error: bytes = b" ",
    tag: bytes = b"LY",
) -> bytes:
    """41 bytes, written out apart from the parser's table."""
    body = struct.pack("<7f", *p_inches, *quat_wxyz) + struct.pack("<I", time_ms) + b" "
    return tag + bytes([station]) + b"C" + error + b"\0" + struct.pack("<H", len(body)) + body


class FakePolhemus(SerialDevice):
    """Sends when told to, and only when it was set going; time begins with its power."""

    def __init__(self, folder: Path, model: PolhemusModel, sensors: int = 2) -> None:
        self.model, self.sensors = model, sensors
        super().__init__(folder)

    def power_on(self) -> None:
        """As the manuals have it: ASCII, inches, position and angles, silent."""
        self.binary = self.continuous = False
        self.metric = False
        self.items = {station: "2,4,1" for station in range(1, 17)}
        self.hemispheres: dict[int, str] = {}
        self.frame = 0

    def obey(self, data: bytes) -> bytes:
        """One letter, or a line."""
        fastrak = self.model is PolhemusModel.FASTRAK
        at_once = b"cCfFuUP" if fastrak else b"P"
        while data:
            if data[0] in at_once:
                command, data = data[:1], data[1:]
            elif b"\r" in data:
                command, data = data.split(b"\r", 1)
            else:
                return data
            self.commands.append(command)
            (self._fastrak if fastrak else self._liberty)(command.decode("ascii"))
        return b""

    def _fastrak(self, command: str) -> None:
        match command[0]:
            case "c":
                self.continuous = False
            case "C":
                self.continuous = True
                self.advance(1)
            case "f" | "F":
                self.binary = command[0] == "f"
            case "u" | "U":
                self.metric = command[0] == "u"
            case _:
                self._set(command)

    def _liberty(self, command: str) -> None:
        match command[0]:
            case "P":
                self.continuous = False
            case "C":
                self.continuous = True
                self.advance(1)
            case "F":
                self.binary = command == "F1"
            case "U":
                self.metric = command == "U1"
            case _:
                self._set(command)

    def _set(self, command: str) -> None:
        station, _, values = command[1:].partition(",")
        for number in range(1, 17) if station == "*" else [int(station)]:
            if command[0] == "O":
                self.items[number] = values
            elif command[0] == "H":
                self.hemispheres[number] = values

    def advance(self, frames: int, lose: int | None = None) -> list[tuple[int, float]]:
        """Send so many frames, without byte ``lose`` of all of them; station and time of each."""
        sent = []
        stream = b""
        with self._lock:
            for _ in range(frames if self.continuous else 0):
                time_s = self.frame / RATE_HZ
                for station in range(1, self.sensors + 1):
                    stream += self._record(station, time_s)
                    sent.append((station, time_s))
                self.frame += 1
            self.send(stream if lose is None else stream[:lose] + stream[lose + 1 :])
        return sent

    def _record(self, station: int, time_s: float) -> bytes:
        p, quat = source_position(station, time_s), quat_at(station, time_s)
        p = p * 2.54 if self.metric else p
        if not self.binary:
            return b"%02d  %.3f %.3f %.3f\r\n" % (station, *p)
        if self.model is PolhemusModel.FASTRAK:
            assert self.items[station] == "2,11,0"
            return fastrak_record(station, p, quat)
        assert self.items[station] == "2,7,8,0"
        tag = b"PA" if self.model is PolhemusModel.PATRIOT else b"LY"
        return liberty_record(station, p, quat, round(time_s * 1000.0), tag=tag)
