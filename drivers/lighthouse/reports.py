"""What a Lighthouse device says in one interrupt report, byte by byte. Pure functions.

Little-endian; times are 48 MHz ticks, a pulse's ``start`` is its rising edge.
"""

import struct
from dataclasses import dataclass

__all__ = [
    "BeamReport",
    "CableReport",
    "GoneReport",
    "ImuReport",
    "ImuSlot",
    "Pulse",
    "PulseReport",
    "RadioReport",
    "Report",
    "SweepReport",
    "parse_report",
]

Pulse = tuple[int, int, int]
"""Port of the sensor, start (32 bits of ticks), length in ticks."""
ImuSlot = tuple[int, int, tuple[int, ...]]
"""Sequence (8 bits), ticks (32 bits), six counts: acceleration x, y, z, gyroscope x, y, z."""


@dataclass(frozen=True, slots=True)
class ImuReport:
    """The newest three samples, the places of which go round; some were in the report before."""

    slots: tuple[ImuSlot, ...]


@dataclass(frozen=True, slots=True)
class PulseReport:
    """Flashes and sweeps of Gen1 stations, not told apart."""

    pulses: tuple[Pulse, ...]


@dataclass(frozen=True, slots=True)
class SweepReport:
    """Syncs and sweeps of Gen2 stations, as words for ``gen2_words.parse_words``."""

    words: bytes


@dataclass(frozen=True, slots=True)
class BeamReport:
    """A Gen2 station lights a device that was set up for Gen1: its light mode must be switched."""


@dataclass(frozen=True, slots=True)
class RadioReport:
    """Messages of the tracker behind a dongle, for ``radio.parse_message``."""

    messages: tuple[bytes, ...]


@dataclass(frozen=True, slots=True)
class GoneReport:
    """The tracker behind a dongle was switched off."""


@dataclass(frozen=True, slots=True)
class CableReport:
    """What a device says by cable besides.

    Attributes:
        buttons: bits, or None: nothing about them. Trigger 0, grip 2, menu 12, system 13.
        battery: 0 to 1, or None: nothing about it.
        charging: the device says so.
    """

    buttons: int | None = None
    battery: float | None = None
    charging: bool = False


Report = ImuReport | PulseReport | SweepReport | BeamReport | RadioReport | GoneReport | CableReport

# 20: IMU, 52 bytes        25: light, 64           21: light, 58           28: light, 64
# 0  u8 id                 0  u8 id                0  u8 id                0  u8 id
# 1  3 x 17 bytes:         1  9 x 7 bytes:         1  7 x 8 bytes:         1  u8 n
#    3 x i16 acceleration     u8  port                u16 port             2  n bytes of words
#    3 x i16 gyroscope        u16 length              u16 length
#    u32 ticks                u32 start               u32 start
#    u8  sequence             port ff, fe: empty      low byte ff, fe: empty
#
# 23: radio, 30 bytes      24: radio, 59           27: raw beams           26: switched off
# 1  message               1, 30 messages (29 bytes each)
#
# 01: by cable, 64 bytes; byte 2 says what follows
# 1: input                 4: battery; seen on a tracker and a Knuckles at the charger
# 8  u32 buttons           12 u16 millivolts
#                          14 u8  bit 7 charging, bits 0-6 percent
IMU, PULSES, OLD_PULSES, WORDS, BEAMS = 0x20, 0x25, 0x21, 0x28, 0x27
RADIO_ONE, RADIO_TWO, GONE = 0x23, 0x24, 0x26
INPUT, POWER = 1, 4
CABLE_BYTES = 16
SLOT = struct.Struct("<6hIB")
PULSE, OLD_PULSE = struct.Struct("<BHI"), struct.Struct("<HHI")
LAST_PORT = 0xFD
MESSAGE_BYTES = 29


def parse_report(data: bytes) -> Report | None:
    """One input report, or None for what is unknown or short."""
    try:
        return _parse(data)
    except struct.error:
        return None


def _parse(data: bytes) -> Report | None:
    match data[0] if data else -1:
        case 0x20:
            return _imu(data)
        case 0x25:
            return PulseReport(_pulses(data, PULSE, 9))
        case 0x21:
            return PulseReport(_pulses(data, OLD_PULSE, 7))
        case 0x28:
            return _words(data)
        case 0x27:
            return BeamReport()
        case 0x23:
            return _radio(data, 1)
        case 0x24:
            return _radio(data, 2)
        case 0x26:
            return GoneReport()
        case 0x01:
            return _cable(data)
    return None


def _imu(data: bytes) -> ImuReport:
    slots = (SLOT.unpack_from(data, 1 + SLOT.size * k) for k in range(3))
    return ImuReport(tuple((slot[7], slot[6], slot[:6]) for slot in slots))


def _pulses(data: bytes, layout: struct.Struct, count: int) -> tuple[Pulse, ...]:
    slots = (layout.unpack_from(data, 1 + layout.size * k) for k in range(count))
    return tuple((s & 0xFF, start, long) for s, long, start in slots if s & 0xFF <= LAST_PORT)


def _words(data: bytes) -> SweepReport | None:
    if len(data) < 2 or len(data) < 2 + data[1]:
        return None
    return SweepReport(data[2 : 2 + data[1]])


def _radio(data: bytes, count: int) -> RadioReport | None:
    if len(data) < 1 + count * MESSAGE_BYTES:
        return None
    return RadioReport(
        tuple(data[1 + MESSAGE_BYTES * k : 1 + MESSAGE_BYTES * (k + 1)] for k in range(count))
    )


def _cable(data: bytes) -> CableReport | None:
    if len(data) < CABLE_BYTES:
        return None
    if data[2] == INPUT:
        return CableReport(buttons=int.from_bytes(data[8:12], "little"))
    if data[2] == POWER:
        return CableReport(battery=min(data[14] & 0x7F, 100) / 100, charging=data[14] >= 0x80)
    return None
