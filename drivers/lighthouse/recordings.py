"""Any recording of Lighthouse devices -> its devices and their raw events."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.drivers.lighthouse.capture_clock import CaptureClock
from lobstr_hw.drivers.lighthouse.capture_stream import CutShort, open_capture, take
from lobstr_hw.drivers.lighthouse.captured_device import read_devices
from lobstr_hw.drivers.lighthouse.imu import ImuRanges
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.survive_text import read_survive_text
from lobstr_hw.drivers.lighthouse.usb_report import UsbReport
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon
from lobstr_hw.drivers.lighthouse.usbpcap import read_usbpcap

__all__ = ["DeviceRecording", "device_name", "read_recording", "usb_reports"]

MAGIC_BYTES = 4


@dataclass(frozen=True, slots=True, eq=False)
class DeviceRecording:
    """Everything that a file holds of one device.

    Attributes:
        name: in the file: bus.address, or what libsurvive called it.
        model: None: its configuration is not in the file, or ``problem`` says what is wrong.
        ranges: None: not in the file; the usual ones then.
        events: all of them.
        clock: the device's time beside the file's.
        problem: what was wrong with the configuration, or empty.
        unread: radio reports that came while nobody knew the device's protocol.
    """

    name: str
    model: DeviceModel | None
    ranges: ImuRanges | None
    events: RawEvents
    clock: CaptureClock
    problem: str = ""
    unread: int = 0


def read_recording(path: Path, model: DeviceModel | None = None) -> list[DeviceRecording]:
    """The devices of a usbmon or USBPcap capture or a libsurvive text recording, gzip or plain.

    Args:
        path: the file.
        model: of a device whose configuration a capture did not see being read.

    Raises:
        FileFormatError: it is none of them, or cannot be read.
    """
    reports = usb_reports(path)
    if reports is None:
        return [
            DeviceRecording(name, d.model, d.ranges, d.lists.events(), d.clock, d.problem)
            for name, d in read_survive_text(path).items()
        ]
    return [
        DeviceRecording(
            device_name(where), d.model, d.ranges, d.reader.take(), d.clock, d.problem, d.unread
        )
        for where, d in read_devices(reports, model).items()
    ]


def usb_reports(path: Path) -> Iterator[UsbReport] | None:
    """The reports of a usbmon or USBPcap capture in their order, or None: it is no such file.

    Raises:
        FileFormatError: it cannot be read.
    """
    with open_capture(path) as stream:
        try:
            magic = take(stream, MAGIC_BYTES)
        except CutShort:
            return None
    match magic:
        case b"\xd4\xc3\xb2\xa1":  # libpcap
            return read_usbmon(path)
        case b"\x0a\x0d\x0d\x0a":  # pcapng
            return read_usbpcap(path)
    return None


def device_name(where: tuple[int, int]) -> str:
    """What a device of a capture is called: bus.address."""
    return f"{where[0]}.{where[1]}"
