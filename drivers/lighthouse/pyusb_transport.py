"""Devices by pyusb and libusb: the second way, which takes them from the kernel's driver.

Between two reads no request is open, so a device that is quicker than the machine may lose a
report; hidapi keeps requests open.
"""

import errno
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from lobstr_hw.drivers.driver import Probe
from lobstr_hw.drivers.lighthouse.report_queue import ReportQueue
from lobstr_hw.drivers.lighthouse.transport import (
    FEATURE_BYTES,
    LinkLost,
    NoAnswer,
    RawReport,
    UsbDeviceInfo,
)
from lobstr_hw.drivers.lighthouse.usb_ids import kind_of
from lobstr_hw.drivers.usb_permission import no_permission
from lobstr_hw.drivers.usb_stream import libusb_backend
from lobstr_hw.drivers.vendor import probe_library, require_library
from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound

__all__ = ["PyusbTransport"]

READ_MS, CONTROL_MS = 50, 1000
REPORT_BYTES = 64
MOST_ERRORS = 20
"""Failed reads in a row after which a device counts as lost, though the system lists it."""
GET, SET = (0xA1, 0x01), (0x21, 0x09)
FEATURE = 0x0300
HID_CLASS = 3
EXTRA = "lighthouse"


class PyusbTransport:
    """The whole of pyusb."""

    @property
    def name(self) -> str:
        """As in the driver's option ``transport``."""
        return "pyusb"

    def probe(self) -> Probe:
        """Whether the package is there; opens nothing."""
        return probe_library("usb", "pyusb", EXTRA)

    def enumerate(self) -> Sequence[UsbDeviceInfo]:
        """Devices of this family that are plugged in.

        Raises:
            DriverUnavailable: pyusb or libusb is missing or does not load.
        """
        core = require_library("usb.core", "pyusb", EXTRA)
        return [info for info in map(_info, _all_devices(core)) if info.interfaces]

    def open(self, info: UsbDeviceInfo) -> "PyusbDevice":
        """Claim a device.

        Raises:
            TrackerNotFound: it is not there any more.
            DeviceBusy: another program has it.
            DriverUnavailable: the permission is missing, or pyusb, or libusb.
        """
        core = require_library("usb.core", "pyusb", EXTRA)
        for device in _all_devices(core):
            if (_key(device), device.idProduct) == (info.key, info.product_id):
                return PyusbDevice(info, _Claim(core, info, device))
        raise TrackerNotFound(f"{info.name} is not there any more: plug it in again")


class _Claim:
    """The claimed interfaces of a device; gives them back, to the kernel's driver too."""

    def __init__(self, core: Any, info: UsbDeviceInfo, device: Any) -> None:
        self.core, self.device = core, device
        self._util = require_library("usb.util", "pyusb", EXTRA)
        self._detached: list[int] = []
        try:
            self.ends = _interrupt_ends(device)
            for interface in self.ends:
                self._take(interface)
        except core.USBError as error:
            self.release()
            raise _refusal(info, error) from error

    def _take(self, interface: int) -> None:
        with suppress(NotImplementedError):  # only Linux has kernel drivers to detach
            if self.device.is_kernel_driver_active(interface):
                self.device.detach_kernel_driver(interface)
                self._detached.append(interface)
        self._util.claim_interface(self.device, interface)

    def release(self) -> None:
        """Never raises."""
        with suppress(self.core.USBError):
            self._util.dispose_resources(self.device)  # releases all interfaces
        for interface in self._detached:
            with suppress(self.core.USBError):
                self.device.attach_kernel_driver(interface)
        with suppress(self.core.USBError):  # attaching opened it again
            self._util.dispose_resources(self.device)


class PyusbDevice:
    """A claimed device."""

    def __init__(self, info: UsbDeviceInfo, claim: _Claim) -> None:
        """Start to read."""
        self._info, self._claim = info, claim
        self._core, self._device = claim.core, claim.device
        self._first = min(claim.ends)
        self._queue = ReportQueue({i: self._fetch(end) for i, end in claim.ends.items()})

    @property
    def info(self) -> UsbDeviceInfo:
        """As it was listed."""
        return self._info

    @property
    def dropped(self) -> int:
        """Reports that nobody read in time."""
        return self._queue.dropped

    def read(self, timeout_s: float) -> RawReport | None:
        """The oldest report not read yet; see ``OpenDevice``."""
        return self._queue.read(timeout_s)

    def get_feature(self, report_id: int, length: int = FEATURE_BYTES) -> bytes:
        """Ask for a feature report; see ``OpenDevice``."""
        answer = bytes(self._control(GET, report_id, length))
        if not answer:
            raise NoAnswer(f"{self._info.name}: feature report {report_id:02x} is empty")
        return answer

    def send_feature(self, data: bytes) -> None:
        """Send a feature report; see ``OpenDevice``."""
        self._control(SET, data[0], data)

    def close(self) -> None:
        """Let go of the device; see ``OpenDevice``."""
        self._queue.close()
        self._claim.release()

    def _control(self, request: tuple[int, int], report_id: int, rest: int | bytes) -> Any:
        if self._queue.lost:
            raise LinkLost(self._queue.lost)
        try:
            return self._device.ctrl_transfer(
                *request, FEATURE | report_id, self._first, rest, CONTROL_MS
            )
        except self._core.USBError as error:
            if error.errno == errno.ENODEV:
                raise LinkLost(str(error)) from error
            raise NoAnswer(
                f"{self._info.name}: feature report {report_id:02x} is refused ({error})"
            ) from error

    def _fetch(self, end: int) -> Callable[[], bytes]:
        failed = 0

        def fetch() -> bytes:
            nonlocal failed
            try:
                data = bytes(self._device.read(end, REPORT_BYTES, READ_MS))
            except self._core.USBTimeoutError:
                return b""
            except self._core.USBError as error:
                failed += 1
                self._recover(end, error, failed)
                return b""
            failed = 0
            return data

        return fetch

    def _recover(self, end: int, error: Any, failed: int) -> None:
        """A stalled endpoint is made to go on; what does not heal is a lost device."""
        if error.errno == errno.ENODEV or failed > MOST_ERRORS:
            raise LinkLost(str(error)) from error
        if error.errno == errno.EPIPE:
            with suppress(self._core.USBError):
                self._device.clear_halt(end)


def _all_devices(core: Any) -> list[Any]:
    def is_known(device: Any) -> bool:
        return kind_of(device.idVendor, device.idProduct) is not None

    try:
        return list(core.find(find_all=True, custom_match=is_known, backend=libusb_backend()))
    except core.NoBackendError as error:
        raise DriverUnavailable(
            f"libusb is not here: pip install 'lobstr-hw[{EXTRA}]', or install libusb-1.0"
        ) from error
    except core.USBError as error:
        raise DriverUnavailable(f"libusb cannot list the devices on USB ({error})") from error


def _key(device: Any) -> str:
    return f"{device.bus}-{device.address}"


def _info(device: Any) -> UsbDeviceInfo:
    kind = kind_of(device.idVendor, device.idProduct)
    assert kind is not None
    return UsbDeviceInfo(
        vendor_id=device.idVendor,
        product_id=device.idProduct,
        serial=_text(device, "serial_number"),
        kind=kind,
        key=_key(device),
        interfaces=tuple((i, f"{end:02x}".encode()) for i, end in _interrupt_ends(device).items()),
        product=_text(device, "product"),
    )


def _text(device: Any, name: str) -> str:
    """A string of the device; to read it pyusb has to open it, which may not be allowed."""
    core = require_library("usb.core", "pyusb", EXTRA)
    try:
        return str(getattr(device, name) or "")
    except (ValueError, NotImplementedError, core.USBError):
        return ""
    finally:
        with suppress(core.USBError):
            require_library("usb.util", "pyusb", EXTRA).dispose_resources(device)


def _interrupt_ends(device: Any) -> dict[int, int]:
    """The interrupt endpoint in of each HID interface."""
    util = require_library("usb.util", "pyusb", EXTRA)
    ends = {}
    for interface in device[0]:
        for end in interface if interface.bInterfaceClass == HID_CLASS else ():
            is_in = util.endpoint_direction(end.bEndpointAddress) == util.ENDPOINT_IN
            if is_in and util.endpoint_type(end.bmAttributes) == util.ENDPOINT_TYPE_INTR:
                ends[interface.bInterfaceNumber] = end.bEndpointAddress
    return ends


def _refusal(info: UsbDeviceInfo, error: Any) -> DriverError:
    if error.errno == errno.EACCES:
        return no_permission(info.name)
    if error.errno == errno.ENODEV:
        return TrackerNotFound(f"{info.name} is not there any more: plug it in again")
    return DeviceBusy(f"{info.name} cannot be opened ({error}): close the program that has it")
