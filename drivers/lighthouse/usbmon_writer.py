"""HID reports -> a capture as usbmon makes it, for usbmon.py and any viewer of USB traffic.

The bytes stand in usbmon.py. A report that was asked for becomes a request and its answer.
"""

import struct
from contextlib import suppress
from pathlib import Path
from threading import Lock

from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon import (
    ASKED,
    CONTROL,
    DONE,
    FEATURE,
    GET_FEATURE,
    HEADER_BYTES,
    INTERRUPT,
    INWARD,
    LINK_TYPE,
    MAGIC,
    RECORD,
    SET_FEATURE,
    USBMON,
)
from lobstr_hw.errors import OutputError

__all__ = ["UsbmonWriter"]

FILE_HEADER = struct.pack("<IHHiIII", MAGIC, 2, 4, 0, 0, 65_535, LINK_TYPE)
MICRO = 1_000_000


class UsbmonWriter:
    """Appends to a capture; may be used by several threads.

    Attributes:
        problem: what ended the file early, and what to do, or empty.
    """

    def __init__(self, path: Path) -> None:
        """Begin the file.

        Raises:
            OutputError: it cannot be written.
        """
        self._path, self.problem = path, ""
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise OutputError(
                f"{path} cannot be written: {error.strerror or error}. "
                "Choose another folder, or make this one first."
            ) from error
        self._lock = Lock()
        self._requests = 0
        self._bytes = len(FILE_HEADER)
        self._file.write(FILE_HEADER)

    def add(self, report: UsbReport) -> None:
        """The next report; nothing more once the file is closed, or the disk is full."""
        with self._lock:
            if self._file.closed:
                return
            self._requests += 1
            try:
                for packet in _packets(report, self._requests):
                    self._file.write(packet)
                    self._bytes += len(packet)
            except OSError as error:
                self._give_up(error)

    def close(self) -> None:
        """Finish; twice is harmless; never raises."""
        with self._lock:
            try:
                self._file.close()
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        with suppress(OSError):
            self._file.close()
        self.problem = self.problem or (
            f"{self._path}: the recording of what went over USB ended after "
            f"{self._bytes / 1e6:.1f} MB ({error.strerror or error}). Free space and record again."
        )


def _packets(report: UsbReport, request: int) -> list[bytes]:
    match report.kind:
        case ReportKind.INPUT:
            return [_packet(report, request, DONE, INTERRUPT, report.endpoint, report.data)]
        case ReportKind.FEATURE_GET:
            setup = _setup(GET_FEATURE, report.data)
            return [
                _packet(report, request, ASKED, CONTROL, INWARD, b"", setup),
                _packet(report, request, DONE, CONTROL, INWARD, report.data),
            ]
        case ReportKind.FEATURE_SET:
            setup = _setup(SET_FEATURE, report.data)
            return [
                _packet(report, request, ASKED, CONTROL, 0, report.data, setup),
                _packet(report, request, DONE, CONTROL, 0, b""),
            ]


def _setup(what: bytes, data: bytes) -> bytes:
    return what + bytes([data[0], FEATURE]) + struct.pack("<HH", 0, len(data))


def _packet(
    report: UsbReport,
    request: int,
    kind: int,
    transfer: int,
    endpoint: int,
    data: bytes,
    setup: bytes = bytes(8),
) -> bytes:
    bus, address = report.device
    seconds, micro = divmod(round(report.time_s * MICRO), MICRO)
    head = USBMON.pack(
        request, kind, transfer, endpoint, address, bus, 0, 0,
        seconds, micro, 0, len(data), len(data), setup,
    ).ljust(HEADER_BYTES, b"\0")  # fmt: skip
    count = len(head) + len(data)
    return RECORD.pack(seconds & 0xFFFFFFFF, micro, count, count) + head + data
