"""What an Ascension Flock of Birds says and understands: records and commands, byte by byte."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.magnetic import is_unit
from lobstr_hw.rotations import Array

__all__ = [
    "ASK_STATUS",
    "MOST_BIRDS",
    "POINT",
    "RECORD_BYTES",
    "FlockRecord",
    "auto_configure",
    "birds_with_sensor",
    "parse_grouped",
    "parse_single",
    "setup_commands",
]

MOST_BIRDS = 14
POINT = b"B"
"""Stop streaming."""
STREAM = b"@"
ASK_STATUS = b"O\x24"
GROUP_MODE = b"P\x23\x01"
POSITION_QUATERNION = b"]"

ACCESSIBLE, HAS_SENSOR = 0x80, 0x20
HEMISPHERES = {"x": b"\x00", "y": b"\x06", "z": b"\x0c"}
FULL_SCALE = 32768.0
RECORD_BYTES = 14


@dataclass(frozen=True, slots=True, eq=False)
class FlockRecord:
    """One reading of one bird.

    Attributes:
        address: of the bird on the bus, from 1.
        p: (3,) in the transmitter's frame, as a fraction of the range.
        quat_wxyz: (4,) as the device has it.
    """

    address: int
    p: Array
    quat_wxyz: Array


# Position and quaternion: 14 bytes, in group mode one more. Bit 7 is set in the first byte alone.
#
#   0   lo hi  x  \                            lo  p l l l l l l l    p: the phase bit
#   2   lo hi  y   |  of the range             hi  0 h h h h h h h
#   4   lo hi  z  /                            value = h h h h h h h l l l l l l l 0 0, signed
#   6   lo hi  w x y z, of 32768
#   14  u8 address (group mode)
def parse_single(data: bytes) -> FlockRecord | None:
    """14 bytes of a bird on its own, or None when they are not a record."""
    return _record(data, 1)


def parse_grouped(data: bytes) -> FlockRecord | None:
    """15 bytes of one bird of several, or None when they are not a record."""
    return _record(data[:-1], data[-1]) if 1 <= data[-1] <= MOST_BIRDS else None


def _record(data: bytes, address: int) -> FlockRecord | None:
    if not data[0] & 0x80 or any(byte & 0x80 for byte in data[1:]):
        return None
    pairs = np.frombuffer(data, np.uint8).reshape(7, 2).astype(np.uint16)
    words = ((pairs[:, 0] & 0x7F) << 2 | pairs[:, 1] << 9).astype(np.int16)
    values = words / FULL_SCALE
    return FlockRecord(address, values[:3], values[3:]) if is_unit(values[3:]) else None


def auto_configure(units: int) -> bytes:
    """Make so many units on the bus one flock; takes the device 0.3 s and up."""
    return b"P\x32" + bytes([units])


def birds_with_sensor(status: bytes) -> list[int]:
    """Addresses of the birds that can be read, from the 14 bytes after ASK_STATUS."""
    wanted = ACCESSIBLE | HAS_SENSOR
    return [address for address, byte in enumerate(status, 1) if byte & wanted == wanted]


def setup_commands(birds: Sequence[int], hemisphere: str) -> list[bytes]:
    """What makes the device stream, first to last; no ``birds``: one without a bus."""
    side = b"L" + HEMISPHERES[hemisphere[-1]] + bytes([hemisphere.startswith("-")])
    if not birds:
        return [POSITION_QUATERNION, side, STREAM]
    to = [bytes([0xF0 + address]) for address in birds]
    each = [prefix + command for prefix in to for command in (POSITION_QUATERNION, side)]
    return [GROUP_MODE, *each, STREAM]
