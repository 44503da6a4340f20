"""One HID report as a capture holds it: what came in, what was asked for, what was sent."""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["ReportKind", "UsbReport"]


class ReportKind(StrEnum):
    """How a report travelled."""

    INPUT = "input"
    FEATURE_GET = "feature_get"
    FEATURE_SET = "feature_set"


@dataclass(frozen=True, slots=True)
class UsbReport:
    """One HID report; ``data`` begins with the report's id.

    Attributes:
        device: bus and address, which a device keeps until it is unplugged.
        time_s: when the host saw it, in the capture's own time; a capture may hold a broken one.
        kind: how it travelled. Only feature reports that the device answered are given.
        endpoint: it came through, 0x81 and up; 0 for feature reports.
    """

    device: tuple[int, int]
    time_s: float
    kind: ReportKind
    endpoint: int
    data: bytes
