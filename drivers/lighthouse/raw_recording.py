"""A transport that writes down all that goes over it, for ``lobstr-record --raw``.

What it writes is a capture as usbmon makes it, so that a take can be decoded, solved and tracked
again by a later version: ``lobstr-log import``.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from threading import Lock

from lobstr_hw.drivers.driver import Probe
from lobstr_hw.drivers.lighthouse.transport import (
    FEATURE_BYTES,
    OpenDevice,
    RawReport,
    Transport,
    UsbDeviceInfo,
)
from lobstr_hw.drivers.lighthouse.usb_ids import KNOWN
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon_writer import UsbmonWriter

__all__ = ["RawRecording"]

FIRST_ENDPOINT = 0x81
FIRST_ADDRESS, ADDRESSES = 1, 127
"""Of one USB bus."""


class RawRecording:
    """Keeps to ``Transport``; reaches devices by another one.

    Each opening of a device has an address of its own in the file, as one that is plugged in anew.
    """

    def __init__(self, transport: Transport, path: Path) -> None:
        """Begin the file.

        Raises:
            OutputError: it cannot be written.
        """
        self._transport = transport
        self._writer = UsbmonWriter(path)
        self._lock = Lock()
        self._opened = 0
        self._unix_s = time.time() - time.perf_counter()

    @property
    def name(self) -> str:
        """The other one's."""
        return self._transport.name

    def probe(self) -> Probe:
        """Whether the other one can be used."""
        return self._transport.probe()

    def enumerate(self) -> Sequence[UsbDeviceInfo]:
        """What the other one lists."""
        return self._transport.enumerate()

    def open(self, info: UsbDeviceInfo) -> OpenDevice:
        """Claim a device, and write down what it says from now on."""
        device = self._transport.open(info)
        with self._lock:
            bus, address = divmod(self._opened, ADDRESSES)
            self._opened += 1
        return _Recorded(device, self, (bus + 1, address + FIRST_ADDRESS))

    def write(self, device: tuple[int, int], kind: ReportKind, endpoint: int, data: bytes,
              at_s: float | None = None) -> None:  # fmt: skip
        """One report, as of now or of a moment by ``time.perf_counter``."""
        now_s = time.perf_counter() if at_s is None else at_s
        self._writer.add(UsbReport(device, self._unix_s + now_s, kind, endpoint, data))

    @property
    def problem(self) -> str:
        """What ended the file early, and what to do, or empty."""
        return self._writer.problem

    def close(self) -> None:
        """Finish the file; devices may still be read, unrecorded."""
        self._writer.close()


class _Recorded:
    """An open device; keeps to ``OpenDevice``."""

    def __init__(self, device: OpenDevice, record: RawRecording, where: tuple[int, int]) -> None:
        self._device, self._record, self._where = device, record, where
        known = KNOWN.get((device.info.vendor_id, device.info.product_id))
        self._endpoints = known.endpoints if known else ()

    @property
    def info(self) -> UsbDeviceInfo:
        return self._device.info

    @property
    def dropped(self) -> int:
        return self._device.dropped

    def read(self, timeout_s: float) -> RawReport | None:
        report = self._device.read(timeout_s)
        if report is not None:
            k, data = report.interface, report.data
            known = k < len(self._endpoints)
            endpoint = self._endpoints[k] if known else FIRST_ENDPOINT + k
            self._record.write(self._where, ReportKind.INPUT, endpoint, data, report.arrived_s)
        return report

    def get_feature(self, report_id: int, length: int = FEATURE_BYTES) -> bytes:
        data = self._device.get_feature(report_id, length)
        if data:
            self._record.write(self._where, ReportKind.FEATURE_GET, 0, data)
        return data

    def send_feature(self, data: bytes) -> None:
        self._device.send_feature(data)
        if data:
            self._record.write(self._where, ReportKind.FEATURE_SET, 0, data)

    def close(self) -> None:
        self._device.close()
