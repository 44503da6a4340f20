"""USB devices for test beds and fakes, scripted from captures of real ones."""

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from support.scripted_usb import CONFIG_PIECE, CONFIG_START, ScriptedDevice

from lobstr_hw.drivers.lighthouse.usb_ids import KNOWN
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon

__all__ = ["devices_of_capture", "scripted", "usb_identities"]

LONGEST_PAUSE_S = 1.0
"""One capture has a broken time stamp."""


def devices_of_capture(path: Path, after_config: bool = False) -> list[ScriptedDevice]:
    """Every device of a usbmon capture with its identity from the file beside it.

    Args:
        path: of the capture; its name and .usbdevs is the list of devices.
        after_config: leave out what a device sent before its configuration was read.
    """
    by_address: dict[int, list[UsbReport]] = defaultdict(list)
    for report in read_usbmon(path):
        by_address[report.device[1]].append(report)
    return [
        scripted(vendor, product, address, by_address[address], after_config)
        for vendor, product, address, _ in usb_identities(path)
    ]


def usb_identities(path: Path) -> list[tuple[int, int, int, tuple[int, ...]]]:
    """Vendor, product, address and endpoints of a capture's devices, from the file beside it."""
    listed = path.with_name(f"{path.name}.usbdevs").read_text(encoding="utf-8").splitlines()
    found = []
    for line in filter(None, listed):
        vendor, product, _, address, _ = line.split()
        ends = KNOWN[int(vendor), int(product)].endpoints
        found.append((int(vendor), int(product), int(address), ends))
    return found


def scripted(
    vendor: int,
    product: int,
    address: int,
    reports: Iterable[UsbReport],
    after_config: bool = False,
) -> ScriptedDevice:
    """A device that answers and sends what these reports hold."""
    ends = KNOWN[vendor, product].endpoints
    device = ScriptedDevice(vendor, product, address, f"SERIAL{address}", "a device", ends)
    run: list[bytes] = []
    last_s = time_s = 0.0
    for report in reports:
        time_s += min(max(report.time_s - last_s, 0.0), LONGEST_PAUSE_S) if last_s else 0.0
        last_s = report.time_s
        if report.kind is ReportKind.INPUT:
            device.reports.append((time_s, ends.index(report.endpoint), report.data))
        elif report.kind is ReportKind.FEATURE_GET and report.data[0] == CONFIG_PIECE:
            run.append(report.data)
            if report.data[1] == 0:
                device.features[CONFIG_PIECE] = run
                if after_config:
                    device.reports = []
        elif report.kind is ReportKind.FEATURE_GET:
            run = [] if report.data[0] == CONFIG_START else run
            device.features.setdefault(report.data[0], []).append(report.data)
    return device
