"""What a file is, by how it begins."""

from enum import StrEnum
from pathlib import Path

from lobstr_hw.drivers.lighthouse.capture_stream import CutShort, open_capture, take
from lobstr_hw.drivers.lighthouse.recordings import usb_reports
from lobstr_hw.runtime.commands.log_export import CSV_COLUMNS

__all__ = ["RecordingKind", "recording_kind"]

LOOKED_AT = 256


class RecordingKind(StrEnum):
    """What can be imported."""

    CSV = "csv"
    USB = "usb"
    SURVIVE = "survive"
    UNKNOWN = "unknown"


def recording_kind(path: Path) -> RecordingKind:
    """Told by the first bytes, unpacked.

    Raises:
        FileFormatError: there is no such file.
    """
    if usb_reports(path) is not None:
        return RecordingKind.USB
    with open_capture(path) as stream:
        begin = b""
        try:
            while len(begin) < LOOKED_AT and not begin.endswith(b"\n"):
                begin += take(stream, 1)
        except CutShort:
            pass
    line = begin.split(b"\n")[0].decode("utf-8", "replace").strip()
    if line.startswith(CSV_COLUMNS[0]):
        return RecordingKind.CSV
    return RecordingKind.SURVIVE if _is_survive(line) else RecordingKind.UNKNOWN


def _is_survive(line: str) -> bool:
    """Seconds, device, what, fields."""
    parts = line.split(None, 3)
    try:
        return len(parts) >= 3 and float(parts[0]) >= 0.0
    except ValueError:
        return False
