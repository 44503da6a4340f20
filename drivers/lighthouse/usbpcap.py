"""USB traffic captured on Windows (USBPcap, link type 249 of pcapng) as HID reports.

    pcapng block                     enhanced packet, block 6        USBPcap header, then data
    0   u32 type                     8   u32 interface               0   u16 bytes of this header
    4   u32 bytes of the block n     12  u32 time, high half         2   u64 id of the request
    8   body                         16  u32 time, low half, us      16  u8  bit 0: from the device
    n-4 u32 n again                  20  u32 bytes here              17  u16 bus, u16 device
                                     28  the packet                  21  u8  endpoint, 0x80: in
    first block: 0a0d0d0a, byte                                      22  u8  1 interrupt, 2 control
    order mark 1a2b3c4d at 8                                         23  u32 bytes of data

A control transfer has the eight set-up bytes as its first packet's data, and what a SET sends
behind them or in a packet of its own.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from lobstr_hw.drivers.lighthouse.capture_stream import LONGEST, CutShort, open_capture, take
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon import FEATURE, GET_FEATURE, MOST_PENDING, SET_FEATURE
from lobstr_hw.errors import FileFormatError

__all__ = ["read_usbpcap"]

BLOCK = struct.Struct("<II")
SECTION, PACKET = 0x0A0D0D0A, 6
BYTE_ORDER = struct.pack("<I", 0x1A2B3C4D)
ENHANCED = struct.Struct("<IIII4x")
USBPCAP = struct.Struct("<HQIHBHHBBI")
INTERRUPT, CONTROL = 1, 2
INWARD = 0x80
SETUP_BYTES = 8


def read_usbpcap(path: Path) -> Iterator[UsbReport]:
    """The HID reports of a capture, in its order; a cut or damaged file gives what is before.

    Raises:
        FileFormatError: this is no pcapng file of little-endian order.
    """
    with open_capture(path) as stream:
        try:
            kind, length = BLOCK.unpack(take(stream, BLOCK.size))
            order = take(stream, len(BYTE_ORDER))
            if (kind, order) != (SECTION, BYTE_ORDER) or length > LONGEST:
                raise CutShort
            take(stream, max(0, length - BLOCK.size - len(order)))
        except CutShort:
            raise FileFormatError(f"{path}: no pcapng capture, as USBPcap records it") from None
        pending: dict[int, bytes] = {}
        for time_s, packet in _packets(stream):
            yield from _report(time_s, packet, pending)


def _packets(stream: IO[bytes]) -> Iterator[tuple[float, bytes]]:
    try:
        while True:
            kind, length = BLOCK.unpack(take(stream, BLOCK.size))
            if not BLOCK.size + 4 <= length <= LONGEST:
                return
            body = take(stream, length - BLOCK.size)
            if kind == PACKET and len(body) >= ENHANCED.size:
                _, high, low, count = ENHANCED.unpack_from(body)
                yield (high << 32 | low) * 1e-6, body[ENHANCED.size : ENHANCED.size + count]
    except CutShort:
        return


def _report(time_s: float, packet: bytes, pending: dict[int, bytes]) -> Iterator[UsbReport]:
    """One packet; ``pending`` holds the set-up of the feature requests that are not done."""
    if len(packet) < USBPCAP.size:
        return
    header, request, _, _, info, bus, address, endpoint, transfer, count = USBPCAP.unpack_from(
        packet
    )
    data = packet[header : header + count]
    where, answer = (bus, address), bool(info & 1)
    if transfer == INTERRUPT and answer and endpoint & INWARD and data:
        yield UsbReport(where, time_s, ReportKind.INPUT, endpoint, data)
    if transfer != CONTROL:
        return
    setup = pending.pop(request, b"")
    if not setup and not answer and len(data) >= SETUP_BYTES and data[3] == FEATURE:
        setup, data = data[:SETUP_BYTES], data[SETUP_BYTES:]
        if not data and len(pending) < MOST_PENDING:
            pending[request] = setup
    if setup[:2] == GET_FEATURE and answer and data:
        yield UsbReport(where, time_s, ReportKind.FEATURE_GET, 0, data)
    elif setup[:2] == SET_FEATURE and not answer and data:
        yield UsbReport(where, time_s, ReportKind.FEATURE_SET, 0, data)
