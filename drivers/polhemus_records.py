"""What Polhemus trackers say and understand: records and commands, byte by byte."""

import struct
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from lobstr_hw.drivers.magnetic import axis_vector, is_unit
from lobstr_hw.rotations import Array

__all__ = [
    "FASTRAK_RECORD",
    "LIBERTY_RECORD",
    "STATIONS",
    "PolhemusModel",
    "PolhemusRecord",
    "parse_fastrak",
    "parse_liberty",
    "setup_commands",
]

REACH_INCHES = 400.0
"""Ten metres, beyond any of these sources: what is further is no record."""


class PolhemusModel(StrEnum):
    """Which of the three speaks."""

    FASTRAK = "fastrak"
    LIBERTY = "liberty"
    PATRIOT = "patriot"


STATIONS = {PolhemusModel.FASTRAK: 4, PolhemusModel.LIBERTY: 16, PolhemusModel.PATRIOT: 2}


@dataclass(frozen=True, slots=True, eq=False)
class PolhemusRecord:
    """One reading of one station.

    Attributes:
        station: from 1.
        tracked: the device reports no error.
        p_inches: (3,) in the source's frame.
        quat_wxyz: (4,) sensor to source.
        time_ms: of the device's clock, where it has one.
    """

    station: int
    tracked: bool
    p_inches: Array
    quat_wxyz: Array
    time_ms: int | None = None


# FASTRAK, output list 2, 11, 0 (position, quaternion, space): 32 bytes, little-endian
#
#   0  '0'             3  3 x f32 position, inches    31  ' '
#   1  station '1'-'4' 15 4 x f32 quaternion w x y z
#   2  status: ' ' = fine, else a letter
FASTRAK_RECORD = struct.Struct("<ccc3f4fc")


def parse_fastrak(data: bytes) -> PolhemusRecord | None:
    """32 bytes -> a record, or None when they are not one."""
    if data[:1] != b"0" or not b"1" <= data[1:2] <= b"4" or data[-1:] != b" ":
        return None
    _, station, status, *numbers, _ = FASTRAK_RECORD.unpack(data)
    if status != b" " and not status.isalpha():
        return None
    return _record(int(station), status == b" ", np.array(numbers), None)


# LIBERTY and PATRIOT, output list 2, 7, 8, 0 (position, quaternion, time, space): 41 bytes
#
#   0  "LY" or "PA"       6  u16 length of what follows: 33    36 u32 time, ms
#   2  u8 station, from 1 8  3 x f32 position, inches          40 ' '
#   3  u8 command         20 4 x f32 quaternion w x y z
#   4  u8 error: ' ' = fine
#   5  u8 reserved
LIBERTY_RECORD = struct.Struct("<2sBcccH3f4fIc")
LIBERTY_TAGS = frozenset({b"LY", b"PA"})
LIBERTY_BODY = LIBERTY_RECORD.size - 8


def parse_liberty(data: bytes) -> PolhemusRecord | None:
    """41 bytes -> a record, or None when they are not one."""
    if data[:2] not in LIBERTY_TAGS or data[-1:] != b" ":
        return None
    _, station, _, error, _, size, *numbers, time_ms, _ = LIBERTY_RECORD.unpack(data)
    if size != LIBERTY_BODY or not 1 <= station <= STATIONS[PolhemusModel.LIBERTY]:
        return None
    return _record(station, error == b" ", np.array(numbers), time_ms)


def _record(
    station: int, tracked: bool, numbers: Array, time_ms: int | None
) -> PolhemusRecord | None:
    p_inches, quat_wxyz = numbers[:3], numbers[3:]
    if not is_unit(quat_wxyz) or not np.all(np.abs(p_inches) < REACH_INCHES):
        return None
    return PolhemusRecord(station, tracked, p_inches, quat_wxyz, time_ms)


def setup_commands(model: PolhemusModel, stations: int, hemisphere: str) -> list[bytes]:
    """What makes the device send records, first to last; the first one stops it."""
    side = b"%d,%d,%d\r" % tuple(int(value) for value in axis_vector(hemisphere))
    if model is not PolhemusModel.FASTRAK:  # a star means every station
        return [b"P", b"F1\r", b"U0\r", b"O*,2,7,8,0\r", b"H*," + side, b"C\r"]
    items = [b"O%d,2,11,0\r" % station for station in range(1, stations + 1)]
    sides = [b"H%d," % station + side for station in range(1, stations + 1)]
    return [b"c", b"U", b"f", *items, *sides, b"C"]  # one letter has no carriage return
