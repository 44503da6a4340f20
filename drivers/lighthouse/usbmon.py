"""USB traffic captured on Linux (usbmon, link type 220 of libpcap) as HID reports.

    pcap header, 24 bytes          record header, 16         usbmon header, 64, then data
    0   u32 magic a1b2c3d4         0   u32 seconds           0   u64 id of the request
    20  u32 link type: 220         4   u32 microseconds      8   u8  'S' asked, 'C' done, 'E' error
                                   8   u32 bytes here        9   u8  1 interrupt, 2 control
                                   12  u32 bytes sent        10  u8  endpoint, 0x80: in
                                                             11  u8  device, u16 bus
                                                             36  u32 bytes of data here
                                                             40  8 bytes set-up

A HID input report is a 'C' with transfer 1. A feature report that is asked for is an 'S' with the
set-up a1 01 ID 03 and the 'C' of the same id; one that is sent, an 'S' with 21 09 ID 03.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from lobstr_hw.drivers.lighthouse.capture_stream import LONGEST, CutShort, open_capture, take
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.errors import FileFormatError

__all__ = ["GET_FEATURE", "SET_FEATURE", "read_usbmon"]

FILE_HEADER = struct.Struct("<I16xI")
MAGIC, LINK_TYPE = 0xA1B2C3D4, 220
RECORD = struct.Struct("<IIII")
USBMON = struct.Struct("<QBBBBHBBqiiII8s")
HEADER_BYTES = 64
DONE, ASKED = ord("C"), ord("S")
INTERRUPT, CONTROL = 1, 2
INWARD = 0x80
GET_FEATURE, SET_FEATURE = b"\xa1\x01", b"\x21\x09"
FEATURE = 3
MOST_PENDING = 256
"""Requests whose answers are waited for; a host has a few open at a time."""


def read_usbmon(path: Path) -> Iterator[UsbReport]:
    """The HID reports of a capture, in its order; a cut or damaged file gives what is before.

    Raises:
        FileFormatError: this is no usbmon capture.
    """
    with open_capture(path) as stream:
        try:
            magic, link_type = FILE_HEADER.unpack(take(stream, FILE_HEADER.size))
        except CutShort:
            magic = link_type = 0
        if (magic, link_type) != (MAGIC, LINK_TYPE):
            raise FileFormatError(
                f"{path}: magic {magic:x}, link type {link_type}; a usbmon capture has "
                f"{MAGIC:x}, {LINK_TYPE}. Record with: tcpdump -i usbmonN -w FILE"
            )
        pending: dict[int, bytes] = {}
        for record in _records(stream):
            yield from _report(record, pending)


def _records(stream: IO[bytes]) -> Iterator[bytes]:
    try:
        while True:
            _, _, count, _ = RECORD.unpack(take(stream, RECORD.size))
            if count > LONGEST:  # a bad bit in a compressed stream makes noise of the rest
                return
            yield take(stream, count)
    except CutShort:
        return


def _report(record: bytes, pending: dict[int, bytes]) -> Iterator[UsbReport]:
    """One record; ``pending`` holds the set-up of the feature requests that wait."""
    if len(record) < HEADER_BYTES:
        return
    header = USBMON.unpack_from(record)
    request, kind, transfer, endpoint, address, bus, _, _, seconds, micro, *_, count, setup = header
    data = record[HEADER_BYTES : HEADER_BYTES + count]
    where, time_s = (bus, address), seconds + micro * 1e-6
    if transfer == INTERRUPT and kind == DONE and endpoint & INWARD and data:
        yield UsbReport(where, time_s, ReportKind.INPUT, endpoint, data)
    elif transfer == CONTROL and kind == ASKED and setup[3] == FEATURE:
        if setup[:2] == SET_FEATURE and data:
            yield UsbReport(where, time_s, ReportKind.FEATURE_SET, 0, data)
        elif setup[:2] == GET_FEATURE and len(pending) < MOST_PENDING:
            pending[request] = setup
    elif transfer == CONTROL and kind == DONE and pending.pop(request, None) and data:
        yield UsbReport(where, time_s, ReportKind.FEATURE_GET, 0, data)
