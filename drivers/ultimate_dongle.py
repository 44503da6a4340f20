"""The wireless dongle of Vive Ultimate Trackers as a HID device."""

from contextlib import suppress
from typing import Any

from lobstr_hw.drivers.ultimate_reports import DongleCommand, command_report, read_answer
from lobstr_hw.drivers.usb_permission import device_node, may_open, no_permission
from lobstr_hw.drivers.vendor import require_library
from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound

__all__ = ["Dongle"]

DONGLE = (0x0BB4, 0x0350)
READ_MS = 50
REPORT_BYTES = 1024
ANSWER_TRIES = 10


class Dongle:
    """The HID device; the only place that writes to it, and only what ``command_report`` lets."""

    def __init__(self) -> None:
        """Claim the first dongle.

        Raises:
            TrackerNotFound: none is plugged in.
            DeviceBusy: another program has it.
            DriverUnavailable: hidapi or the permission is missing.
        """
        hid = _hid_library()
        found = [d for d in hid.enumerate(*DONGLE) if d["interface_number"] in (0, -1)]
        if not found:
            raise TrackerNotFound(
                f"no dongle of Vive Ultimate Trackers ({DONGLE[0]:04x}:{DONGLE[1]:04x}) on USB: "
                "plug it in"
            )
        self._device: Any = hid.device()
        try:
            self._device.open_path(found[0]["path"])
        except OSError as error:
            raise _refusal(found[0]["path"], error) from error

    def send(self, command: DongleCommand, data: bytes) -> None:
        """Send a command; OSError when the dongle is gone."""
        report = command_report(command, data)
        if self._device.send_feature_report(report) < 0:
            raise OSError("the dongle takes no command")

    def ask(self, command: DongleCommand, data: bytes) -> str:
        """Text that the dongle has about itself; nothing when it does not say."""
        self.send(command, data)
        for _ in range(ANSWER_TRIES):
            answer = read_answer(bytes(self._device.get_feature_report(0, 65)), command)
            if answer is not None:
                return answer.rstrip(b"\0").decode("ascii", "replace")
        return ""

    def read(self) -> bytes:
        """One input report, or nothing in 0.05 s; OSError when the dongle is gone."""
        return bytes(self._device.read(REPORT_BYTES, READ_MS))

    def close(self) -> None:
        """Let go of it; never raises."""
        with suppress(OSError):
            self._device.close()


def _refusal(path: bytes, error: OSError) -> DriverError:
    node = device_node(path)
    if node is not None and not may_open(node):
        return no_permission("the dongle of Vive Ultimate Trackers")
    return DeviceBusy(f"the dongle cannot be opened ({error}): close VIVE Hub")


def _hid_library() -> Any:
    """On Linux the wheel's ``hidraw``, which leaves the kernel's driver in place; else ``hid``."""
    with suppress(DriverUnavailable):
        return require_library("hidraw", "hidapi", "hid")
    return require_library("hid", "hidapi", "hid")
