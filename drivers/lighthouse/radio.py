"""What a wand, tracker or Knuckles says by radio, in the messages of its dongle. Pure functions.

    message, 29 bytes                IMU block, 13 bytes     input, after its flags
    0  u8 ticks, bits 31-24          0  u8 ticks, 15-8       flag 1: u8 buttons
    1  u8 bytes after byte 2, + 1    1  3 x i16 acc          flag 4: u8 trigger
    2  u8 ticks, bits 23-16          7  3 x i16 gyro         flag 2: i16 pad x, i16 pad y
    3  payload, then stale bytes                             none: a1, 7 bytes (Knuckles)

The payload begins with flags. Old protocol (wands, Tracker 1.0, always Gen1):

    e2       heartbeat                      111x1iii  input iii, then IMU block if x
    below e0 all is light                   111x0001  battery byte, then flags again or light
    111 else one of the forms to the right  111x0000  IMU block if x

and what is left is light. New protocol (everything else), parts in this order:

    80 IMU block    40 metadata    20 input: flags as above, then the input    10 light to the end
    metadata: 80 battery byte | 20, 1 byte | 30, 2 bytes | others: the rest cannot be read
    battery: bit 7 charging, bits 0-6 percent
"""

import struct
from dataclasses import dataclass, field

__all__ = ["Inputs", "RadioMessage", "parse_message"]

HEARTBEAT = 0xE2
NOT_LIGHT = 0xE0
INPUT, WITH_IMU, BATTERY, UNKNOWN = 0x10, 0x08, 0x01, 0x06
BUTTONS, PAD, TRIGGER = 0x01, 0x02, 0x04
NEW_IMU, NEW_METADATA, NEW_INPUT, NEW_LIGHT = 0x80, 0x40, 0x20, 0x10
META_BATTERY, META_LENGTHS = 0x80, {0x80: 1, 0x20: 1, 0x30: 2}
KNUCKLES, KNUCKLES_BYTES = 0xA1, 7
IMU_BLOCK = struct.Struct("<B6h")


@dataclass(frozen=True, slots=True)
class Inputs:
    """Buttons and the like, as far as a message tells them.

    Attributes:
        buttons: bits. Wand: trigger, pad touch, pad click, system, grip, menu from bit 0; Knuckles:
            trigger, pad touch, stick click, system, A, B, menu.
        trigger: 0 to 255.
        pad: x, y of 32768, of the stick too.
        fingers: seven bytes of a Knuckles: touch flags, proximity of middle, ring, pinky and index
            finger, forces of squeeze and pad.
    """

    buttons: int | None = None
    trigger: int | None = None
    pad: tuple[int, int] | None = None
    fingers: bytes = b""


@dataclass(frozen=True, slots=True)
class RadioMessage:
    """One message, taken apart.

    Attributes:
        ticks: 32 bits: the IMU sample's time if there is one, else roughly the message's.
        imu: six counts, acceleration and gyroscope, or None.
        light: compact form, or words when the device is in a Gen2 light mode.
        battery: 0 to 1.
        charging: the device says so.
        inputs: None where nothing is told about them.
    """

    ticks: int
    imu: tuple[int, ...] | None = None
    light: bytes = b""
    battery: float | None = None
    charging: bool = False
    inputs: Inputs | None = None


def parse_message(message: bytes, old_protocol: bool) -> RadioMessage | None:
    """One message of a radio report, or None: it makes no sense."""
    if len(message) < 3 or not 2 <= message[1] <= len(message) - 2:
        return None
    ticks = message[0] << 24 | message[2] << 16
    reader = _Reader(message[3 : 2 + message[1]], ticks)
    try:
        if reader.rest[0] != HEARTBEAT:
            _read_old(reader) if old_protocol else _read_new(reader)
    except (IndexError, struct.error, _Unknown):
        return None
    return RadioMessage(
        reader.ticks, reader.imu, reader.light, reader.battery, reader.charging, reader.inputs
    )


class _Unknown(Exception):
    """A part whose length nobody knows."""


@dataclass(slots=True)
class _Reader:
    """Takes the parts off the front of a payload."""

    rest: bytes
    ticks: int
    imu: tuple[int, ...] | None = None
    light: bytes = b""
    battery: float | None = None
    charging: bool = False
    inputs: Inputs | None = field(default=None)

    def take(self, layout: struct.Struct) -> tuple[int, ...]:
        """The numbers of a layout."""
        values = layout.unpack_from(self.rest)
        self.rest = self.rest[layout.size :]
        return values

    def take_byte(self) -> int:
        """One byte."""
        value, self.rest = self.rest[0], self.rest[1:]
        return value

    def take_imu(self) -> None:
        """An IMU block; it completes the time."""
        low, *counts = self.take(IMU_BLOCK)
        self.ticks |= low << 8
        self.imu = tuple(counts)

    def take_battery(self) -> None:
        """A battery byte."""
        value = self.take_byte()
        self.battery, self.charging = (value & 0x7F) / 100, bool(value & 0x80)

    def take_inputs(self, flags: int) -> None:
        """Buttons, trigger, pad, or a Knuckles' fingers."""
        if not flags & (BUTTONS | PAD | TRIGGER):
            self._take_fingers()
            return
        buttons = self.take_byte() if flags & BUTTONS else None
        trigger = self.take_byte() if flags & TRIGGER else None
        x, y = self.take(struct.Struct("<2h")) if flags & PAD else (None, None)
        self.inputs = Inputs(buttons, trigger, None if x is None or y is None else (x, y))

    def _take_fingers(self) -> None:
        if self.take_byte() != KNUCKLES or len(self.rest) < KNUCKLES_BYTES:
            raise _Unknown
        self.inputs = Inputs(fingers=self.rest[:KNUCKLES_BYTES])
        self.rest = self.rest[KNUCKLES_BYTES:]


def _read_old(reader: _Reader) -> None:
    while reader.rest and reader.rest[0] >= NOT_LIGHT:
        flags = reader.take_byte()
        if flags & INPUT:
            reader.take_inputs(flags)
        elif flags & UNKNOWN:
            raise _Unknown
        elif flags & BATTERY:
            reader.take_battery()
            continue
        if flags & WITH_IMU:
            reader.take_imu()
        break
    reader.light = reader.rest


def _read_new(reader: _Reader) -> None:
    flags = reader.take_byte()
    if flags & NEW_IMU:
        reader.take_imu()
    if flags & NEW_METADATA and not _read_metadata(reader):
        return
    if flags & NEW_INPUT:
        reader.take_inputs(reader.take_byte())
    if flags & NEW_LIGHT:
        reader.light = reader.rest


def _read_metadata(reader: _Reader) -> bool:
    """False: its length is unknown, and what follows is lost."""
    marker = reader.take_byte()
    if marker == META_BATTERY:
        reader.take_battery()
        return True
    reader.rest = reader.rest[META_LENGTHS.get(marker, 0) :]
    return marker in META_LENGTHS
