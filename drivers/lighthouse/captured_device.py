"""The devices of a USB capture: configurations and settings from the traffic, raw events."""

from collections.abc import Iterable

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.drivers.lighthouse.capture_clock import CaptureClock
from lobstr_hw.drivers.lighthouse.device_config import (
    CONFIG_PIECE,
    CONFIG_START,
    MOST_PIECES,
    inflate_config,
    join_pieces,
    parse_config,
)
from lobstr_hw.drivers.lighthouse.device_reader import OLD_RADIO, DeviceReader
from lobstr_hw.drivers.lighthouse.imu import RANGES, ImuRanges, parse_ranges
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.errors import FileFormatError

__all__ = ["CapturedDevice", "read_devices"]

DONGLE = 0xFF
PROTOCOL, PROTOCOL_LENGTH = 0x87, 6
RADIO_REPORTS = frozenset({0x23, 0x24})


class CapturedDevice:
    """One device of a capture, fed with its reports in their order.

    What a dongle passes on before the tracker's configuration was read is left alone: nobody knows
    in which protocol it is.

    Attributes:
        model: from the configuration that the capture saw being read, or None.
        ranges: of the IMU, or None: the capture did not see them being asked for.
        reader: what the device says.
        clock: its time beside the capture's.
        problem: what was wrong with the configuration, or empty.
        unread: reports of a dongle that were left alone.
    """

    def __init__(self, model: DeviceModel | None = None) -> None:
        """Nothing was heard; ``model``: what it is, for as long as the capture does not say."""
        self.model = model
        self.ranges: ImuRanges | None = None
        old_radio = model is not None and model.product_id in OLD_RADIO
        self.reader = DeviceReader(old_radio, gen2_light=False)
        self.clock = CaptureClock()
        self.problem, self.unread = "", 0
        self._pieces: list[bytes] = []

    def feed(self, report: UsbReport) -> None:
        """The next report."""
        match report.kind:
            case ReportKind.INPUT:
                if self.model is not None or report.data[0] not in RADIO_REPORTS:
                    self._hear(report)
                else:
                    self.unread += 1
            case ReportKind.FEATURE_GET:
                self._answered(report.data)
            case ReportKind.FEATURE_SET:
                self._told(report.data)

    def _hear(self, report: UsbReport) -> None:
        before = self.reader.newest_tick
        self.reader.feed(report.data)
        newest = self.reader.newest_tick
        if newest is not None and newest != before:
            self.clock.observe(newest, report.time_s)

    def _answered(self, data: bytes) -> None:
        if data[0] == RANGES:
            self.ranges = parse_ranges(data) or self.ranges
        elif data[0] == CONFIG_START:
            self._pieces = []
        elif data[0] == CONFIG_PIECE and len(data) > 1 and len(self._pieces) < MOST_PIECES:
            self._pieces.append(data)
            if data[1] == 0:
                self._configure()

    def _configure(self) -> None:
        try:
            self.model = parse_config(inflate_config(join_pieces(self._pieces)))
        except FileFormatError as error:
            self.problem = str(error)
            return
        self.problem = ""
        if self.model.product_id in OLD_RADIO:
            self.reader.use_old_radio()

    def _told(self, data: bytes) -> None:
        """A dongle's change of protocol; byte 4 is the light mode."""
        if data[:3] == bytes([DONGLE, PROTOCOL, PROTOCOL_LENGTH]) and len(data) > 4:
            self.reader.switch_light(gen2=data[4] != 0)


def read_devices(
    reports: Iterable[UsbReport], model: DeviceModel | None = None
) -> dict[tuple[int, int], CapturedDevice]:
    """All devices of a capture that sent anything, by bus and address.

    Args:
        reports: of the capture.
        model: of a device whose configuration the capture did not see being read.
    """
    devices: dict[tuple[int, int], CapturedDevice] = {}
    for report in reports:
        devices.setdefault(report.device, CapturedDevice(model)).feed(report)
    for device in devices.values():
        device.reader.finish()
    return devices
