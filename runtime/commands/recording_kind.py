"""What a file is, by how it begins."""

from enum import StrEnum
from pathlib import Path

from lobstr_hw.drivers.lighthouse.capture_stream import CutShort, open_capture, take
from lobstr_hw.runtime.commands.log_export import CSV_COLUMNS

__all__ = ["RecordingKind", "recording_kind"]

PCAP, PCAPNG = b"\xd4\xc3\xb2\xa1", b"\x0a\x0d\x0d\x0a"
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
    with open_capture(path) as stream:
        begin = b""
        try:
            while len(begin) < LOOKED_AT:
                begin += take(stream, 1)
        except CutShort:
            pass
    if begin[:4] in (PCAP, PCAPNG):
        return RecordingKind.USB
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
