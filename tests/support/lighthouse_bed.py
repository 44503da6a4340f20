"""The bed of scripted USB devices (lighthouse_testbed.py), for the program that runs in it."""

import json
import os
import socket
import sys
from typing import Any

from lobstr_hw.drivers.lighthouse import pyusb_transport

__all__ = ["ENVIRONMENT", "RemoteBed", "use_system_libusb"]

ENVIRONMENT = "LOBSTR_USB_BED"

if sys.platform == "win32":
    FAMILY = socket.AF_INET  # never used: for the type checker, which knows no AF_UNIX there
else:
    FAMILY = socket.AF_UNIX


def use_system_libusb() -> None:
    """Let pyusb use Debian's libusb: it hears of plugs by udev, which umockdev speaks.

    The one of the package libusb-package listens to the kernel itself, which the bed is not.
    """
    pyusb_transport.__dict__["libusb_backend"] = lambda: None


class RemoteBed:
    """Steers the devices of the bed, by their number in the script."""

    def __init__(self) -> None:
        self._socket = socket.socket(FAMILY)
        self._socket.connect(os.environ[ENVIRONMENT])
        self._lines = self._socket.makefile("rw", encoding="utf-8")

    def _call(self, *call: object) -> Any:
        self._lines.write(json.dumps(call) + "\n")
        self._lines.flush()
        return json.loads(self._lines.readline())

    def plug(self, number: int = 0) -> None:
        """Back, from the beginning of its script."""
        self._call("plug", number)

    def unplug(self, number: int = 0) -> None:
        """Gone."""
        self._call("unplug", number)

    def play(self, count: int, number: int = 0) -> None:
        """Let go of so many more of its reports."""
        self._call("play", number, count)

    def put(self, data: bytes, interface: int = 0, number: int = 0) -> None:
        """Let it send a report that is not in the script."""
        self._call("put", number, interface, data.hex())

    def fault(self, name: str, value: object, number: int = 0) -> None:
        """Set a fault of its FeatureAnswers."""
        self._call("fault", number, name, value)

    def halt(self, *ends: int, number: int = 0) -> None:
        """Let endpoints STALL until the halt is cleared."""
        self._call("halt", number, ends)

    def sent(self, number: int = 0) -> list[bytes]:
        """Feature reports that were written to it."""
        return [bytes.fromhex(text) for text in self._call("sent", number)]

    def waiting(self, number: int = 0) -> int:
        """Reports that were let go and nobody fetched."""
        count: int = self._call("waiting", number)
        return count

    def close(self) -> None:
        """Let go of the bed."""
        self._lines.close()
        self._socket.close()
