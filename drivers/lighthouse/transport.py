"""How Lighthouse devices are reached on USB: what every way to do it keeps to.

An open device's input reports are fetched in the background from the moment it is opened, each
stamped when it came, so that nothing is lost while the caller thinks; ``read`` hands them out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from lobstr_hw.drivers.driver import Probe
from lobstr_hw.drivers.lighthouse.usb_ids import KNOWN, DeviceKind
from lobstr_hw.drivers.reading_thread import LinkLost

__all__ = ["LinkLost", "NoAnswer", "OpenDevice", "RawReport", "Transport", "UsbDeviceInfo"]

FEATURE_BYTES = 64
"""The longest feature report of this family, its id included."""


class NoAnswer(Exception):
    """The device refused a feature report (STALL) or did not answer; it may still be there."""


@dataclass(frozen=True, slots=True)
class UsbDeviceInfo:
    """A device as the system lists it; nothing was opened.

    Attributes:
        vendor_id: of USB.
        product_id: of USB.
        serial: of USB, or empty: it has none, or may not be read. A dongle's is its own.
        kind: by the identity.
        key: names the device among those that are plugged in now.
        interfaces: number and the transport's own path, lowest number first.
        product: as the device calls itself, or empty.
    """

    vendor_id: int
    product_id: int
    serial: str
    kind: DeviceKind
    key: str
    interfaces: tuple[tuple[int, bytes], ...]
    product: str = ""

    @property
    def name(self) -> str:
        """For messages: what it is and which one."""
        known = KNOWN.get((self.vendor_id, self.product_id))
        what = known.name if known else f"USB device {self.vendor_id:04x}:{self.product_id:04x}"
        return f"{what} {self.serial}" if self.serial else what


@dataclass(frozen=True, slots=True)
class RawReport:
    """One input report.

    Attributes:
        interface: it came through; reports of one interface are in order.
        data: begins with the report's id, as ``DeviceReader.feed`` wants it.
        arrived_s: when, by ``time.perf_counter``.
    """

    interface: int
    data: bytes
    arrived_s: float


class OpenDevice(Protocol):
    """A device that was claimed."""

    @property
    def info(self) -> UsbDeviceInfo:
        """As it was listed."""
        ...

    @property
    def dropped(self) -> int:
        """Reports that were thrown away because nobody read them."""
        ...

    def read(self, timeout_s: float) -> RawReport | None:
        """The oldest report not read yet; None: none came in that time (0: do not wait).

        Raises:
            LinkLost: the device is gone, and all that came before was read.
        """
        ...

    def get_feature(self, report_id: int, length: int = FEATURE_BYTES) -> bytes:
        """Ask for a feature report; the answer begins with its id and may be shorter.

        Raises:
            NoAnswer: refused.
            LinkLost: the device is gone.
        """
        ...

    def send_feature(self, data: bytes) -> None:
        """Send a feature report, its id first.

        Raises:
            NoAnswer: refused.
            LinkLost: the device is gone.
        """
        ...

    def close(self) -> None:
        """Let go of the device and end what ran for it; twice is harmless; never raises."""
        ...


class Transport(Protocol):
    """A way to reach devices. Its library is imported at the first ``enumerate`` or ``open``."""

    @property
    def name(self) -> str:
        """As in the driver's option ``transport``."""
        ...

    def probe(self) -> Probe:
        """Whether it can be used here; opens nothing."""
        ...

    def enumerate(self) -> Sequence[UsbDeviceInfo]:
        """Devices of this family that are plugged in.

        Raises:
            DriverUnavailable: its library is missing or does not load.
        """
        ...

    def open(self, info: UsbDeviceInfo) -> OpenDevice:
        """Claim a device.

        Raises:
            TrackerNotFound: it is not there any more.
            DeviceBusy: another program has it.
            DriverUnavailable: the permission is missing (the message says the cure), or a library.
        """
        ...
