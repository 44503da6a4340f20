"""A tracker that speaks its serial protocol over two USB bulk endpoints."""

import errno
from contextlib import suppress
from typing import Any

from lobstr_hw.drivers.reading_thread import LinkLost
from lobstr_hw.drivers.usb_permission import no_permission
from lobstr_hw.drivers.vendor import require_library
from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound

__all__ = ["BulkLink", "libusb_backend"]

READ_MS = 50
READ_BYTES = 4096


class BulkLink:
    """The first device with one of the given USB identities, interface 0."""

    def __init__(self, name: str, identities: frozenset[tuple[int, int]]) -> None:
        """Claim the device.

        Args:
            name: for messages, as in "Polhemus LIBERTY".
            identities: vendor and product numbers.

        Raises:
            TrackerNotFound: none is plugged in.
            DeviceBusy: another program has it.
            DriverUnavailable: pyusb, libusb or the permission is missing.
        """
        self._core = require_library("usb.core", "pyusb", "hid")
        try:
            device = self._core.find(
                custom_match=lambda d: (d.idVendor, d.idProduct) in identities,
                backend=libusb_backend(),
            )
            if device is None:
                ids = ", ".join(f"{v:04x}:{p:04x}" for v, p in sorted(identities))
                raise TrackerNotFound(
                    f"no {name} on USB (looked for {ids}): plug it in and switch it on, "
                    "or name its serial port with port="
                )
            self._device: Any = device
            self._in, self._out = _bulk_endpoints(device)
        except self._core.NoBackendError as error:
            raise DriverUnavailable(
                "libusb is not here: pip install 'lobstr-hw[hid]', or install libusb-1.0"
            ) from error
        except self._core.USBError as error:
            raise _translated(name, error) from error

    def read(self) -> bytes:
        """What has come in; waits 0.05 s at most.

        Raises:
            LinkLost: the device is gone.
        """
        try:
            return bytes(self._device.read(self._in, READ_BYTES, READ_MS))
        except self._core.USBTimeoutError:
            return b""
        except self._core.USBError as error:
            raise LinkLost(str(error)) from error

    def write(self, data: bytes) -> None:
        """Send.

        Raises:
            LinkLost: the device is gone.
        """
        try:
            self._device.write(self._out, data, 1000)
        except self._core.USBError as error:
            raise LinkLost(str(error)) from error

    def quiet(self) -> None:
        """Throw away what comes in until nothing does, half a second at most."""
        for _ in range(10):
            if not self.read():
                return

    def close(self) -> None:
        """Release the device; never raises."""
        util = require_library("usb.util", "pyusb", "hid")
        with suppress(self._core.USBError):
            util.dispose_resources(self._device)


def libusb_backend() -> Any:
    """The libusb that came with the extra, or else (None) the system's."""
    try:
        return require_library("libusb_package", "libusb-package", "hid").get_libusb1_backend()
    except DriverUnavailable:
        return None


def _bulk_endpoints(device: Any) -> tuple[int, int]:
    """Addresses of the bulk endpoints in and out of the first interface, configured and claimed."""
    util = require_library("usb.util", "pyusb", "hid")
    with suppress(NotImplementedError):  # only Linux has kernel drivers to detach
        if device.is_kernel_driver_active(0):
            device.detach_kernel_driver(0)
    device.set_configuration()
    interface = device.get_active_configuration()[(0, 0)]
    bulk = [e for e in interface if util.endpoint_type(e.bmAttributes) == util.ENDPOINT_TYPE_BULK]
    ends = {util.endpoint_direction(e.bEndpointAddress): e.bEndpointAddress for e in bulk}
    try:
        return ends[util.ENDPOINT_IN], ends[util.ENDPOINT_OUT]
    except KeyError as error:
        raise TrackerNotFound("the USB device has no pair of bulk endpoints: name port=") from error


def _translated(name: str, error: Any) -> DriverError:
    if error.errno == errno.EBUSY:
        return DeviceBusy(f"another program has the {name}: close that program")
    if error.errno == errno.EACCES:
        return no_permission(f"the {name}")
    return TrackerNotFound(f"the {name} on USB does not answer ({error}): unplug it and try again")
