"""Devices by hidapi: ``hidraw`` on Linux (beside the kernel's driver), ``hid`` everywhere."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from threading import Lock
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
from lobstr_hw.drivers.lighthouse.usb_ids import HTC, VALVE, kind_of
from lobstr_hw.drivers.usb_permission import device_node, may_open, no_permission
from lobstr_hw.drivers.vendor import probe_library, require_library
from lobstr_hw.errors import DeviceBusy, DriverError, TrackerNotFound

__all__ = ["HidapiTransport"]

ONE_AT_A_TIME = Lock()
"""Listing, opening and closing share what hidapi keeps for all; reading and asking do not."""
READ_MS = 50
REPORT_BYTES = 64
EXTRA = "lighthouse"


class HidapiTransport:
    """One backend of hidapi."""

    def __init__(self, name: str, module: str) -> None:
        """Import nothing yet; ``module``: of the package hidapi."""
        self._name, self._module = name, module

    @property
    def name(self) -> str:
        """As in the driver's option ``transport``."""
        return self._name

    def probe(self) -> Probe:
        """Whether the package is there; opens nothing."""
        return probe_library(self._module, "hidapi", EXTRA)

    def enumerate(self) -> Sequence[UsbDeviceInfo]:
        """Devices of this family that are plugged in.

        Raises:
            DriverUnavailable: hidapi is missing or does not load.
        """
        hid = require_library(self._module, "hidapi", EXTRA)
        with ONE_AT_A_TIME:
            entries = [entry for vendor in (VALVE, HTC) for entry in hid.enumerate(vendor, 0)]
        return _devices(entries)

    def open(self, info: UsbDeviceInfo) -> "HidapiDevice":
        """Claim a device.

        Raises:
            TrackerNotFound: it is not there any more.
            DeviceBusy: another program has it.
            DriverUnavailable: the permission is missing, or hidapi.
        """
        hid = require_library(self._module, "hidapi", EXTRA)
        handles: dict[int, Any] = {}
        try:
            for interface, path in info.interfaces:
                handles[interface] = hid.device()
                with ONE_AT_A_TIME:
                    handles[interface].open_path(path)
        except OSError as error:
            for handle in handles.values():
                handle.close()
            raise self._refusal(info, path) from error
        return HidapiDevice(info, handles)

    def _refusal(self, info: UsbDeviceInfo, path: bytes) -> DriverError:
        """Why a device could not be opened: hidapi does not say."""
        if all(info.key != other.key for other in self.enumerate()):
            return TrackerNotFound(f"{info.name} is not there any more: plug it in again")
        node = device_node(path)
        if node is not None and not may_open(node):
            return no_permission(info.name)
        return DeviceBusy(f"{info.name} cannot be opened: close the program that has it (SteamVR?)")


class HidapiDevice:
    """A device with a handle for each interface; feature reports go through the first."""

    def __init__(self, info: UsbDeviceInfo, handles: dict[int, Any]) -> None:
        """Start to read; ``handles``: open ones, by interface."""
        self._info, self._handles = info, handles
        self._features = handles[min(handles)]
        self._queue = ReportQueue({i: _fetch(handle) for i, handle in handles.items()})

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
        try:
            answer = bytes(self._features.get_feature_report(report_id, length))
        except (OSError, ValueError) as error:  # ValueError: closed
            raise self._refused(f"{report_id:02x} is not told", error) from error
        if not answer:
            raise NoAnswer(f"{self._info.name}: feature report {report_id:02x} is empty")
        return answer

    def send_feature(self, data: bytes) -> None:
        """Send a feature report; see ``OpenDevice``."""
        try:
            sent = self._features.send_feature_report(data)
        except (OSError, ValueError) as error:
            raise self._refused(f"{data[0]:02x} is not taken", error) from error
        if sent < 0:
            raise self._refused(f"{data[0]:02x} is not taken")

    def close(self) -> None:
        """Let go of the device; see ``OpenDevice``."""
        self._queue.close()
        for handle in self._handles.values():
            with suppress(OSError), ONE_AT_A_TIME:
                handle.close()

    def _refused(self, what: str, error: Exception | None = None) -> Exception:
        if self._queue.lost:
            return LinkLost(self._queue.lost)
        why = f" ({error})" if error else ""
        return NoAnswer(f"{self._info.name}: feature report {what}{why}")


def _fetch(handle: Any) -> Callable[[], bytes]:
    return lambda: bytes(handle.read(REPORT_BYTES, READ_MS))


def _devices(entries: Sequence[dict[str, Any]]) -> list[UsbDeviceInfo]:
    """One of each device: hidapi lists interfaces, and some of them more than once."""
    found: dict[tuple[int, int, str, int], dict[int, dict[str, Any]]] = {}
    seen: set[bytes] = set()
    for entry in sorted(entries, key=lambda e: bytes(e["path"])):
        identity = (entry["vendor_id"], entry["product_id"], entry["serial_number"] or "")
        if kind_of(*identity[:2]) is None or entry["path"] in seen or _is_repeat(entry["path"]):
            continue
        seen.add(entry["path"])
        interface = max(entry["interface_number"], 0)  # -1: it does not know
        nth = 0  # of devices that have no serial or the same
        while interface in found.get((*identity, nth), {}):
            nth += 1
        found.setdefault((*identity, nth), {})[interface] = entry
    return [_info(interfaces) for interfaces in found.values()]


def _is_repeat(path: bytes) -> bool:
    """Windows lists every collection of an interface; they all give the same reports."""
    return b"&col" in path.lower() and b"&col01" not in path.lower()


def _info(interfaces: dict[int, dict[str, Any]]) -> UsbDeviceInfo:
    first = interfaces[min(interfaces)]
    kind = kind_of(first["vendor_id"], first["product_id"])
    assert kind is not None
    return UsbDeviceInfo(
        vendor_id=first["vendor_id"],
        product_id=first["product_id"],
        serial=first["serial_number"] or "",
        kind=kind,
        key=bytes(first["path"]).decode("utf-8", "replace"),
        interfaces=tuple((i, bytes(interfaces[i]["path"])) for i in sorted(interfaces)),
        product=first["product_string"] or "",
    )
