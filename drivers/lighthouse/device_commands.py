"""What a device is asked and told when it is opened: feature reports, and nothing else is written.

get 01  IMU ranges (imu.py)           set 04 mm 0 0 0     light mode, by cable: 0 Gen1, 1 Gen2
get 05  version, below                set 07 03 0 0 0     how much light is told, by cable
get 10, 11  configuration             set ff cmd n data   to a dongle
            (device_config.py)            96  radio set-up
                                          87  protocol and light mode

05: version, 53 bytes, names' bits 7 are noise
1   u32 firmware     9   32 bytes name    49  u16, u8, u8 version of the FPGA
5   u32              41  u32 hardware
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from lobstr_hw.drivers.lighthouse.device_config import (
    CONFIG_PIECE,
    CONFIG_START,
    MOST_PIECES,
    inflate_config,
    join_pieces,
)
from lobstr_hw.drivers.lighthouse.imu import RANGES, ImuRanges, parse_ranges
from lobstr_hw.drivers.lighthouse.transport import NoAnswer, OpenDevice
from lobstr_hw.drivers.lighthouse.usb_ids import DeviceKind
from lobstr_hw.errors import FileFormatError

__all__ = [
    "DeviceVersion",
    "ask_ranges",
    "ask_version",
    "download_config",
    "parse_version",
    "set_light_mode",
    "start_reports",
]

VERSION = 0x05
DOWNLOAD_TRIES, RANGE_TRIES = 3, 5
RADIO_SET_UP = bytes.fromhex("ff9610be5b325411cf8375538a086a5358d0b1")
COMPACT_PROTOCOL = bytes.fromhex("ff8703000100")
DONGLE_LIGHT = {
    False: bytes.fromhex("ff8706010000020000"),
    True: bytes.fromhex("ff8706010100020000"),
}
CABLE_LIGHT = {False: bytes.fromhex("0400000000"), True: bytes.fromhex("0401000000")}
CABLE_VERBOSE = bytes.fromhex("0703000000")
VERSION_LAYOUT = struct.Struct("<BII32sII")


@dataclass(frozen=True, slots=True)
class DeviceVersion:
    """What a device says of its make.

    Attributes:
        firmware: the time at which it was built, as SteamVR shows it: eight hexadecimal digits.
        name: of the kind of device, as its maker calls it.
    """

    firmware: str
    name: str


def download_config(device: OpenDevice) -> bytes:
    """The JSON that a device keeps about itself; of what is behind it if it is a dongle.

    Raises:
        NoAnswer: it has none to give: nothing is switched on behind the dongle.
        FileFormatError: what it gives, again and again, is cut short or damaged.
        LinkLost: it is gone.
    """
    problem = ""
    for _ in range(DOWNLOAD_TRIES):
        device.get_feature(CONFIG_START)
        try:
            return inflate_config(join_pieces(_pieces(device)))
        except FileFormatError as error:
            problem = str(error)
    raise FileFormatError(f"{device.info.name}: {problem} ({DOWNLOAD_TRIES} tries)")


def _pieces(device: OpenDevice) -> Iterator[bytes]:
    """Until an empty one; a device that stops answering half way gives what it gave."""
    for _ in range(MOST_PIECES):
        try:
            piece = device.get_feature(CONFIG_PIECE)
        except NoAnswer:
            return
        if len(piece) < 2 or piece[1] == 0:
            return
        yield piece


def ask_ranges(device: OpenDevice) -> ImuRanges | None:
    """The ranges of the IMU; None: it does not say, and the usual ones are to be taken.

    Raises:
        LinkLost: it is gone.
    """
    for _ in range(RANGE_TRIES):  # the first answers may be zeros
        try:
            ranges = parse_ranges(device.get_feature(RANGES))
        except NoAnswer:
            return None
        if ranges is not None:
            return ranges
    return None


def ask_version(device: OpenDevice) -> DeviceVersion | None:
    """Its firmware and name; None: it does not say.

    Raises:
        LinkLost: it is gone.
    """
    try:
        return parse_version(device.get_feature(VERSION))
    except NoAnswer:
        return None


def parse_version(data: bytes) -> DeviceVersion | None:
    """The answer to feature report 05; None: it is none."""
    if len(data) < VERSION_LAYOUT.size or data[0] != VERSION:
        return None
    _, firmware, _, name, _, _ = VERSION_LAYOUT.unpack_from(data)
    text = bytes(c & 0x7F for c in name).split(b"\0")[0].decode("ascii")
    return DeviceVersion(f"{firmware:08x}", "".join(c for c in text if c.isprintable()))


def start_reports(device: OpenDevice, gen2: bool) -> None:
    """Tell a device to send its light; it may have been left in any state.

    Args:
        device: whose configuration was read before: in this order every device is known to start.
        gen2: the light mode.

    Raises:
        NoAnswer: refused.
        LinkLost: it is gone.
    """
    if device.info.kind is DeviceKind.DONGLE:
        device.send_feature(RADIO_SET_UP)
        device.send_feature(DONGLE_LIGHT[gen2])
        device.send_feature(COMPACT_PROTOCOL)
    else:
        set_light_mode(device, gen2)


def set_light_mode(device: OpenDevice, gen2: bool) -> None:
    """Change which stations' light a device tells; some light is lost with it.

    Raises:
        NoAnswer: refused.
        LinkLost: it is gone.
    """
    if device.info.kind is DeviceKind.DONGLE:
        device.send_feature(DONGLE_LIGHT[gen2])
    else:
        device.send_feature(CABLE_LIGHT[gen2])
        device.send_feature(CABLE_VERBOSE)
