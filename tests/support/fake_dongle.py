"""The dongle of Vive Ultimate Trackers: what it answers and sends. Standard library only.

It stands behind the real hidapi in a test bed (hidraw_testbed.py), whose Python has no numpy, or
behind a stand-in for hidapi's module (``fake_hid_module``).
"""

import queue
import struct
import time
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType

__all__ = [
    "PRODUCT",
    "SERIAL",
    "VENDOR",
    "FakeDongle",
    "buttons_report",
    "fake_hid_module",
    "links_report",
    "pair_report",
    "pose_report",
    "text_report",
]

VENDOR, PRODUCT = 0x0BB4, 0x0350
SERIAL = "FA3983C06815"
FIRMWARE = "1.0.999"
FEATURE_BYTES = 64


def _address(index: int) -> bytes:
    return bytes([0x23, 0x30 | index, 0x42, 0xB7, 0x82, 0xD3])


def _from_tracker(index: int, kind: int, body: bytes) -> bytes:
    return (
        b"\x28"
        + struct.pack("<H", 7)
        + _address(index)
        + struct.pack("<HB", kind, len(body))
        + body
    )


def pose_report(
    index: int, p: Sequence[float], quat: Sequence[float], state: int = 2, buttons: int = 0
) -> bytes:
    """A pose of 37 bytes, padded as HID pads it."""
    body = bytes([index, buttons]) + struct.pack("<3f", *p) + struct.pack("<4e", *quat)
    body += (
        struct.pack("<3e", 0.0, 9.8, 0.0) + struct.pack("<4e", 0.0, 0.0, 0.0, 0.0) + bytes([state])
    )
    return _from_tracker(index, 0x0110, body).ljust(64, b"\0")


def buttons_report(index: int, buttons: int) -> bytes:
    """A tracker that has no pose yet."""
    return _from_tracker(index, 0x0110, bytes([index, buttons])).ljust(64, b"\0")


def text_report(index: int, text: str) -> bytes:
    """A message of a tracker."""
    return _from_tracker(index, 0x0101, text.encode("ascii")).ljust(64, b"\0")


def pair_report(index: int, gone: bool = False) -> bytes:
    """A tracker comes or goes."""
    return (b"\x18\x0c\0\0" + bytes([1, gone]) + _address(index)).ljust(64, b"\0")


def links_report(paired: Sequence[bool]) -> bytes:
    """The states of the five links."""
    states = [0x320FC008 if link else 0x01000003 for link in paired]
    return (b"\x1e\x1d\0\0\0\x17\0" + struct.pack("<H5I", 0, *states)).ljust(64, b"\0")


class FakeDongle:
    """Remembers what is written, answers what may be asked, and sends when told to."""

    def __init__(self) -> None:
        self.written: list[bytes] = []
        self.reports: queue.Queue[bytes] = queue.Queue()
        self.plugged = True
        self._answer = bytes(FEATURE_BYTES)

    def set_feature(self, report: bytes) -> None:
        """A command: 0, command, length, data."""
        self.written.append(report)
        command = report[1]
        text = {0xF0: SERIAL, 0xFF: FIRMWARE}.get(command, "")
        head = bytes([0, command, len(text) + 4, 0, 0])
        self._answer = (head + text.encode("ascii")).ljust(FEATURE_BYTES, b"\0")

    def get_feature(self) -> bytes:
        """The answer to the last command."""
        return self._answer

    def put(self, report: bytes) -> None:
        """Send an input report."""
        self.reports.put(report)

    def sent(self) -> list[bytes]:
        """What was written to it."""
        return list(self.written)

    def unplug(self) -> None:
        """Gone, with all that was under way."""
        self.plugged = False
        while not self.reports.empty():
            self.reports.get_nowait()

    def plug(self) -> None:
        """Back."""
        self.plugged = True


class _FakeDevice:
    """``hid.device`` of hidapi, as far as a driver may use it."""

    dongle: FakeDongle

    def open_path(self, path: bytes) -> None:
        if not self.dongle.plugged:
            raise OSError("open failed")

    def send_feature_report(self, data: bytes) -> int:
        self._check()
        self.dongle.set_feature(bytes(data))
        return len(data)

    def get_feature_report(self, number: int, length: int) -> list[int]:
        self._check()
        return list(self.dongle.get_feature()[:length])

    def read(self, length: int, timeout_ms: int) -> list[int]:
        end = time.monotonic() + timeout_ms / 1000.0
        while time.monotonic() < end:
            self._check()
            try:
                return list(self.dongle.reports.get(timeout=0.005))[:length]
            except queue.Empty:
                continue
        return []

    def close(self) -> None:
        pass

    def _check(self) -> None:
        if not self.dongle.plugged:
            raise OSError("read error")


def fake_hid_module(dongle: FakeDongle) -> ModuleType:
    """A module with the face of hidapi's, and one device."""

    class Device(_FakeDevice):
        pass

    Device.dongle = dongle
    module = ModuleType("hid")
    module.__spec__ = ModuleSpec("hid", None)

    def enumerate_devices(vendor: int, product: int) -> list[dict[str, object]]:
        present = dongle.plugged and (vendor, product) == (VENDOR, PRODUCT)
        return [{"path": b"fake", "interface_number": 0}] if present else []

    module.__dict__.update(enumerate=enumerate_devices, device=Device)
    return module
