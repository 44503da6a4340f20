"""Any recording of Lighthouse devices -> its devices and their raw events."""

from dataclasses import dataclass
from pathlib import Path

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.drivers.lighthouse.capture_stream import CutShort, open_capture, take
from lobstr_hw.drivers.lighthouse.captured_device import read_devices
from lobstr_hw.drivers.lighthouse.imu import ImuRanges
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.survive_text import read_survive_text
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon
from lobstr_hw.drivers.lighthouse.usbpcap import read_usbpcap

__all__ = ["DeviceRecording", "read_recording"]

PCAP, PCAPNG = b"\xd4\xc3\xb2\xa1", b"\x0a\x0d\x0d\x0a"


@dataclass(frozen=True, slots=True, eq=False)
class DeviceRecording:
    """Everything that a file holds of one device.

    Attributes:
        name: in the file: bus.address, or what libsurvive called it.
        model: None: its configuration is not in the file, or ``problem`` says what is wrong.
        ranges: None: not in the file; the usual ones then.
        events: all of them.
        problem: what was wrong with the configuration, or empty.
    """

    name: str
    model: DeviceModel | None
    ranges: ImuRanges | None
    events: RawEvents
    problem: str = ""


def read_recording(path: Path, model: DeviceModel | None = None) -> list[DeviceRecording]:
    """The devices of a usbmon or USBPcap capture or a libsurvive text recording, gzip or plain.

    Args:
        path: the file.
        model: of a device whose configuration a capture did not see being read.

    Raises:
        FileFormatError: it is none of them, or cannot be read.
    """
    with open_capture(path) as stream:
        try:
            magic = take(stream, len(PCAP))
        except CutShort:
            magic = b""
    if magic not in (PCAP, PCAPNG):
        return [
            DeviceRecording(name, d.model, d.ranges, d.lists.events(), d.problem)
            for name, d in read_survive_text(path).items()
        ]
    devices = read_devices((read_usbmon if magic == PCAP else read_usbpcap)(path), model)
    return [
        DeviceRecording(f"{bus}.{address}", d.model, d.ranges, d.reader.take(), d.problem)
        for (bus, address), d in devices.items()
    ]
