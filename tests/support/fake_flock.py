"""A Flock of Birds that obeys the real commands; the bird at each address has a sensor or not."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from support.serial_bed import SerialDevice

from lobstr_hw.rotations import from_rotation_vector, to_quat_xyzw

__all__ = ["FakeFlock", "flock_record", "flock_words", "transmitter_position", "transmitter_quat"]

Array = NDArray[np.float64]
RANGE_INCHES = 36.0
PARAMETER_BYTES = {0x23: 1, 0x32: 1}


def transmitter_position(address: int, frame: int) -> Array:
    """Where a sensor is, inches; nowhere twice."""
    return np.array([20.0 + 0.1 * frame, 3.0 * address, -5.0 + np.sin(0.1 * frame)])


def transmitter_quat(address: int, frame: int) -> Array:
    """How it is turned, w x y z."""
    turn = np.array([0.1 * address, 0.02 * frame, 0.3])
    return np.roll(to_quat_xyzw(from_rotation_vector(turn)), 1)


def flock_words(values: Array) -> bytes:
    """Fractions of full scale as the device writes them, phase bit and all."""
    data = bytearray()
    for value in values:
        word = int(np.clip(round(float(value) * 32768.0), -32768, 32767)) & 0xFFFF
        data += bytes([word >> 2 & 0x7F, word >> 9])
    data[0] |= 0x80
    return bytes(data)


def flock_record(p_inches: Array, quat_wxyz: Array) -> bytes:
    """14 bytes of position and quaternion."""
    return flock_words(np.concatenate([p_inches / RANGE_INCHES, quat_wxyz]))


@dataclass
class Bird:
    """One unit on the bus."""

    mode: bytes = b"Y"
    hemisphere: bytes = b""


class FakeFlock(SerialDevice):
    """Sends when told to, and only while it streams."""

    def __init__(self, folder: Path, sensors: tuple[int, ...] = (1, 2), units: int = 2) -> None:
        self.sensors, self.units = sensors, units
        super().__init__(folder)

    def power_on(self) -> None:
        """As the manual has it: on its own, position and angles, silent."""
        self.birds = {address: Bird() for address in range(1, self.units + 1)}
        self.streaming = self.grouped = False
        self.configured = 1
        self.target = 1
        self.frame = 0

    def obey(self, data: bytes) -> bytes:
        """Commands are one byte with parameters; a prefix says to whom."""
        while data:
            length = self._length(data)
            if length > len(data):
                return data
            self.commands.append(data[:length])
            self._do(data[:length])
            data = data[length:]
        return b""

    def _length(self, data: bytes) -> int:
        match data[:1]:
            case b"P":
                return 2 + (PARAMETER_BYTES[data[1]] if len(data) > 1 else 0)
            case b"O":
                return 2
            case b"L":
                return 3
        return 1

    def _do(self, command: bytes) -> None:
        bird = self.birds[self.target]
        match command[0]:
            case prefix if prefix >= 0xF0:
                self.target = prefix - 0xF0
                return
            case 0x42:  # B
                self.streaming = False
            case 0x40:  # @
                self.streaming = True
                self.advance(1)
            case 0x50 if command[1] == 0x32:
                self.configured = command[2]
            case 0x50:
                self.grouped = command[2] == 1
            case 0x4F:
                self.send(self._status())
            case 0x4C:
                bird.hemisphere = command[1:]
            case _:
                bird.mode = command
        self.target = 1

    def _status(self) -> bytes:
        bits = [
            (0xC0 | (0x20 if address in self.sensors else 0)) if address <= self.configured else 0
            for address in range(1, 15)
        ]
        return bytes(bits)

    def advance(self, frames: int, lose: int | None = None) -> list[tuple[int, int]]:
        """Send so many frames, without byte ``lose`` of all of them; address and frame of each."""
        sent, stream = [], b""
        with self._lock:
            for _ in range(frames if self.streaming else 0):
                for address in self.sensors if self.grouped else self.sensors[:1]:
                    stream += self._record(address)
                    sent.append((address, self.frame))
                self.frame += 1
            self.send(stream if lose is None else stream[:lose] + stream[lose + 1 :])
        return sent

    def _record(self, address: int) -> bytes:
        tail = bytes([address]) if self.grouped else b""
        p, quat = transmitter_position(address, self.frame), transmitter_quat(address, self.frame)
        if self.birds[address].mode != b"]":
            return flock_words(np.concatenate([p / RANGE_INCHES, np.zeros(3)])) + tail
        return flock_record(p, quat) + tail
