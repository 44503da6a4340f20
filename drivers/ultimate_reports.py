"""What the dongle of Vive Ultimate Trackers says and may be told: reports, byte by byte.

Nobody documents this device; what stands here was found out by others by looking at it, and has not
been tried on one by this project.
"""

import re
import struct
from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np

from lobstr_hw.drivers.magnetic import is_unit
from lobstr_hw.rotations import Array

__all__ = [
    "LINKS",
    "SYSTEM_BUTTON",
    "DongleCommand",
    "LinkStatus",
    "MapState",
    "PairEvent",
    "PoseReport",
    "PoseState",
    "QuatOrder",
    "TextReport",
    "command_report",
    "map_state",
    "parse_pose",
    "parse_report",
    "read_answer",
    "to_tracker",
]

LINKS = 5
"""A dongle takes so many trackers."""
PAIRED = 0x8
SYSTEM_BUTTON = 0x100
"""The only button of the tracker, as far as anybody has seen."""


class QuatOrder(StrEnum):
    """Order of a quaternion's last three numbers, after w: sources disagree."""

    XYZ = "xyz"
    ZYX = "zyx"


class PoseState(IntEnum):
    """How a tracker came by its pose."""

    FULL = 2
    ROTATION_ONLY = 3
    FROZEN_POSITION = 4


class MapState(IntEnum):
    """What a tracker knows of the room."""

    NOT_CHECKED = 0
    EXISTS = 1
    NONE = 2
    REBUILT = 3
    SAVED = 4
    SAVING_FAILED = 5
    REUSED = 6
    ROOM_DIFFERS = 7
    TOO_LITTLE_SEEN = 8
    WAITS_FOR_STANDSTILL = 9
    BEING_BUILT = 10


@dataclass(frozen=True, slots=True, eq=False)
class PoseReport:
    """A tracker's pose in its own map; ``p`` None: this report has buttons only.

    Attributes:
        index: of the tracker at this dongle, 0 to 4.
        buttons: eight bits: with bit 7 set they are bits 8 to 14 of the buttons, else 0 to 6.
        p: (3,) metres.
        quat: (4,) w first, then in the disputed order.
        state: PoseState, or a number nobody knows.
    """

    index: int
    buttons: int
    p: Array | None = None
    quat: Array | None = None
    state: int = 0


@dataclass(frozen=True, slots=True)
class TextReport:
    """A message of a tracker."""

    index: int
    text: str


@dataclass(frozen=True, slots=True)
class PairEvent:
    """A tracker has come (switched on, or paired anew) or gone."""

    index: int
    paired: bool


@dataclass(frozen=True, slots=True)
class LinkStatus:
    """Which of the dongle's links have a tracker."""

    paired: tuple[bool, ...]


# Input reports, little-endian. The first byte says which:
#
#   28 from a tracker       18 pair event         1d, 1e links
#   1  u16 counter          1  u8 length          1  u8 length
#   3  6 bytes address      2  u16                2  5 bytes
#   9  u16 0110 pose        4  u8                 7  u16
#          0101 text        5  u8 1 = gone        9  5 x u32 state, bit 3: paired
#   11 u8 length of         6  6 bytes address
#   12 data                                       the low half of an address's second byte: index
FROM_TRACKER = struct.Struct("<BH6sHB")
POSE, TEXT = 0x0110, 0x0101
PAIRING = struct.Struct("<BBHBB6s")
STATUS = struct.Struct("<BB5sH5I")

Report = PoseReport | TextReport | PairEvent | LinkStatus


def parse_report(data: bytes) -> Report | None:
    """One input report, or None for what is unknown, short or of no link."""
    try:
        match data[0] if data else -1:
            case 0x28:
                return _from_tracker(data)
            case 0x18:
                *_, gone, address = PAIRING.unpack_from(data)
                return PairEvent(_index(address), gone != 1)
            case 0x1D | 0x1E:
                states = STATUS.unpack_from(data)[-LINKS:]
                return LinkStatus(tuple(bool(state & PAIRED) for state in states))
    except (struct.error, ValueError):
        return None
    return None


def _from_tracker(data: bytes) -> Report | None:
    _, _, address, kind, length = FROM_TRACKER.unpack_from(data)
    body = data[FROM_TRACKER.size : FROM_TRACKER.size + length]
    if len(body) != length:
        return None
    if kind == TEXT:
        return TextReport(_index(address), body.rstrip(b"\0").decode("ascii"))
    return parse_pose(_index(address), body) if kind == POSE else None


def _index(address: bytes) -> int:
    index = address[1] & 0x0F
    if index >= LINKS:
        raise ValueError(f"no link {index}")
    return index


# Pose data, 37 or 39 bytes; 2 bytes of a tracker that has no pose yet
#
#   0  u8 index      14 4 x f16 rotation, w first          36 u8 state (PoseState)
#   1  u8 buttons    22 3 x f16 acceleration
#   2  3 x f32 m     28 4 x f16 angular velocity
POSE_DATA = struct.Struct("<BB3f4e3e4eB")
BUTTONS_ONLY = 2


def parse_pose(index: int, body: bytes) -> PoseReport | None:
    """The data of a pose report, or None when it is none that could be believed."""
    if len(body) == BUTTONS_ONLY:
        return PoseReport(index, body[1])
    if len(body) not in (POSE_DATA.size, POSE_DATA.size + 2):
        return None
    _, buttons, *numbers, state = POSE_DATA.unpack_from(body)
    p, quat = np.array(numbers[:3]), np.array(numbers[3:7])
    if not np.isfinite(p).all() or not is_unit(quat):
        return None
    return PoseReport(index, buttons, p, quat, state)


def map_state(text: str) -> MapState | None:
    """What a message says about the map: ``P61:5,STATE`` (the answer) or ``MSid,STATE`` (news)."""
    found = re.fullmatch(r"(?:P61:5|MS-?\d+),(\d+)(?:,.*)?", text)
    return MapState(int(found[1])) if found and int(found[1]) in list(MapState) else None


class DongleCommand(IntEnum):
    """The only commands that this program can send.

    Others write firmware or identities, enter the boot loader, or have made a dongle unusable (21).
    """

    TO_TRACKER = 0x18
    RADIO = 0x1D
    IDENTITY = 0xF0
    ROM_VERSION = 0xFF


TRACKER_TEXTS = re.compile(rb"ATM-1|ATM20|ATM11|P63:[456]")
"""Tracking off, on as the first tracker, on as a further one; asking for map and tracking state.

Left out are those that erase or end a map, switch off, or are kept by the tracker for ever."""
TO_TRACKER = re.compile(rb"\x04\x23[\x30-\x34]\x42\xb7\x82\xd3\x00\x01(.)(.*)", re.DOTALL)
ALLOWED = {
    DongleCommand.RADIO: re.compile(rb"\x00\x01\x01\x01\x01\x00\x00"),  # allow pairing, no other
    DongleCommand.IDENTITY: re.compile(rb"[\x06-\x09\x11]"),
    DongleCommand.ROM_VERSION: re.compile(rb"\x00"),
}
FEATURE_BYTES = 65


def command_report(command: int, data: bytes) -> bytes:
    """The feature report of a command.

    Raises:
        ValueError: it is not among those that may be sent.
    """
    known = DongleCommand(command)
    if not _may_be_sent(known, data):
        raise ValueError(f"{known.name} with {data.hex(' ')} is not on the list of safe commands")
    return (bytes([0, known, len(data) + 2]) + data).ljust(FEATURE_BYTES, b"\0")


def _may_be_sent(command: DongleCommand, data: bytes) -> bool:
    if command is not DongleCommand.TO_TRACKER:
        return ALLOWED[command].fullmatch(data) is not None
    found = TO_TRACKER.fullmatch(data)
    if found is None or found[1][0] != len(found[2]):
        return False
    return TRACKER_TEXTS.fullmatch(found[2]) is not None


def to_tracker(index: int, text: str) -> bytes:
    """Data of DongleCommand.TO_TRACKER: a message for one tracker."""
    data = text.encode("ascii")
    return bytes([0x04, 0x23, 0x30 | index, 0x42, 0xB7, 0x82, 0xD3, 0x00, 0x01, len(data)]) + data


def read_answer(report: bytes, command: DongleCommand) -> bytes | None:
    """Data of the feature report that answers a command, or None: of another command.

    Layout: u8 error, u8 command, u8 length, 2 bytes, length - 4 bytes of data.
    """
    if len(report) < 5 or report[1] != command:
        return None
    return report[5 : 5 + max(0, report[2] - 4)]
