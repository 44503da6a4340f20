"""Polhemus FASTRAK, LIBERTY and PATRIOT: magnetic trackers on a serial line or on USB.

    lobstr-live --driver polhemus:port=/dev/ttyUSB0,model=fastrak
    lobstr-live --driver polhemus:model=liberty            (on USB)

The source's frame has X forward, Y to the right and Z **down** when it stands as it is marked;
``up=`` names the axis that points to the ceiling when it hangs or lies otherwise. A sensor is
always on one side of the source: ``hemisphere=`` names the axis towards the people. Only LIBERTY
and PATRIOT have a clock; FASTRAK's samples have the time of their arrival.
"""

from collections.abc import Callable, Mapping
from typing import ClassVar

from lobstr_hw.drivers.driver import DeviceInfo, Probe
from lobstr_hw.drivers.magnetic import METRES_PER_INCH, signed_axis, source_axes, world_pose
from lobstr_hw.drivers.polhemus_records import (
    FASTRAK_RECORD,
    LIBERTY_RECORD,
    STATIONS,
    PolhemusModel,
    PolhemusRecord,
    parse_fastrak,
    parse_liberty,
    setup_commands,
)
from lobstr_hw.drivers.reading_thread import Reading
from lobstr_hw.drivers.record_source import Link, RecordSource
from lobstr_hw.drivers.serial_stream import SerialLink
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.drivers.usb_stream import BulkLink
from lobstr_hw.drivers.vendor import probe_library
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.trackers import TrackingState

__all__ = ["PolhemusDriver"]

USB_IDENTITIES = {
    PolhemusModel.FASTRAK: frozenset({(0x0F44, 0x0002), (0x0F44, 0x0003)}),
    PolhemusModel.LIBERTY: frozenset({(0x0F44, 0xFF12), (0x0F44, 0xFF20)}),
    PolhemusModel.PATRIOT: frozenset({(0x0F44, 0xEF12), (0x0F44, 0xEF20)}),
}


class PolhemusDriver(StreamDriver):
    """Each station is a tracker with the serial PREFIX-STATION, as in POLHEMUS-1."""

    options: ClassVar[Mapping[str, Callable[[str], object]]] = {
        "model": PolhemusModel,
        "port": str,
        "baud": int,
        "stations": int,
        "up": signed_axis,
        "hemisphere": signed_axis,
        "prefix": str,
    }
    """What ``--driver polhemus:...`` understands, and how it is read."""

    def __init__(
        self,
        model: PolhemusModel = PolhemusModel.FASTRAK,
        port: str = "usb",
        baud: int = 115200,
        stations: int | None = None,
        up: str = "-z",
        hemisphere: str = "x",
        prefix: str = "POLHEMUS",
    ) -> None:
        """Choose a device.

        Args:
            model: which of the three.
            port: of the serial line, or ``usb``.
            baud: of the serial line, as set by the switches at its back.
            stations: of a FASTRAK, how many are set up; all four unless given.
            up: the source's axis that points to the ceiling.
            hemisphere: the source's axis towards the people.
            prefix: of the serials, for more than one device.
        """
        super().__init__()
        self._model, self._port, self._baud, self._prefix = model, port, baud, prefix
        self._R_world_source = source_axes(up)
        stations = STATIONS[model] if stations is None else stations
        if not 1 <= stations <= STATIONS[model]:
            raise ValueError(f"stations={stations}: {model} has 1 to {STATIONS[model]}")
        self._commands = setup_commands(model, stations, hemisphere)

    @classmethod
    def probe(cls) -> Probe:
        """Whether pyserial is here; USB needs pyusb as well, of the same extra."""
        return probe_library("serial", "pyserial", "hid")

    def _connect(self) -> RecordSource[PolhemusRecord]:
        if self._port == "usb":
            name = f"Polhemus {self._model.upper()}"
            return self._started(BulkLink(name, USB_IDENTITIES[self._model]))
        return self._started(SerialLink(self._port, self._baud))

    def _started(self, link: Link) -> RecordSource[PolhemusRecord]:
        fastrak = self._model is PolhemusModel.FASTRAK
        source = RecordSource(
            link,
            (FASTRAK_RECORD if fastrak else LIBERTY_RECORD).size,
            parse_fastrak if fastrak else parse_liberty,
            self._reading,
        )
        if source.start(self._commands[:1], self._commands[1:]):
            return source
        source.close()
        raise TrackerNotFound(
            f"no record of a {self._model} came from {self._port} in 2 s: check that it is on, "
            f"that a sensor is plugged in, model={self._model} and baud={self._baud}"
        )

    def _reading(self, record: PolhemusRecord) -> Reading:
        pose = world_pose(self._R_world_source, record.p_inches * METRES_PER_INCH, record.quat_wxyz)
        state = TrackingState.OK if record.tracked else TrackingState.OUT_OF_RANGE
        device_s = None if record.time_ms is None else record.time_ms * 1e-3
        return Reading(f"{self._prefix}-{record.station}", pose, state, device_s)

    def _info(self, serial: str) -> DeviceInfo:
        return DeviceInfo(serial, "tracker", f"Polhemus {self._model.upper()}")
