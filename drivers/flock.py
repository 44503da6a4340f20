"""Ascension Flock of Birds: magnetic trackers on a serial line.

    lobstr-live --driver flock:port=/dev/ttyUSB0                    (one bird)
    lobstr-live --driver flock:port=COM3,units=4,range_inches=144   (four units, extended range)

The transmitter's frame has X forward, Y to the right and Z **down** when it stands as it is marked;
``up=`` names the axis that points to the ceiling when it hangs or lies otherwise. The device has no
clock: samples have the time of their arrival. Some flocks report how the transmitter stands in the
sensor; ``invert=yes`` turns that round.
"""

import time
from collections.abc import Callable, Mapping
from typing import ClassVar

from lobstr_hw.drivers.driver import DeviceInfo, Probe
from lobstr_hw.drivers.flock_records import (
    ASK_STATUS,
    MOST_BIRDS,
    POINT,
    RECORD_BYTES,
    FlockRecord,
    auto_configure,
    birds_with_sensor,
    parse_grouped,
    parse_single,
    setup_commands,
)
from lobstr_hw.drivers.magnetic import METRES_PER_INCH, signed_axis, source_axes, world_pose
from lobstr_hw.drivers.options import yes_no
from lobstr_hw.drivers.reading_thread import Reading
from lobstr_hw.drivers.record_source import RecordSource
from lobstr_hw.drivers.serial_stream import SerialLink
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.drivers.vendor import probe_library
from lobstr_hw.errors import TrackerNotFound

__all__ = ["FlockDriver"]

CONFIGURING_S = 0.3
"""For so long the flock is deaf, before and after it was told how many units it has."""
RESET_S = (1.0, 2.0)
"""RTS high, then low."""
STATUS_READS = 200
"""Ten seconds: a flock that is starting answers no sooner."""


class FlockDriver(StreamDriver):
    """Each bird is a tracker with the serial PREFIX-ADDRESS, as in FLOCK-1."""

    options: ClassVar[Mapping[str, Callable[[str], object]]] = {
        "port": str,
        "baud": int,
        "units": int,
        "range_inches": float,
        "up": signed_axis,
        "hemisphere": signed_axis,
        "invert": yes_no,
        "reset": yes_no,
        "prefix": str,
    }
    """What ``--driver flock:...`` understands, and how it is read."""

    def __init__(
        self,
        port: str,
        baud: int = 115200,
        units: int = 1,
        range_inches: float = 36.0,
        up: str = "-z",
        hemisphere: str = "x",
        invert: bool = False,
        reset: bool = False,
        prefix: str = "FLOCK",
    ) -> None:
        """Choose a device.

        Args:
            port: of the serial line.
            baud: of the serial line, as set by the switches at its back.
            units: on the bus, an extended-range controller without a sensor included.
            range_inches: what the largest number means: 36, 72, or 144 with the extended range.
            up: the transmitter's axis that points to the ceiling.
            hemisphere: the transmitter's axis towards the people.
            invert: the flock reports the transmitter in the sensor.
            reset: restart it by the RTS wire first, which takes 3 s.
            prefix: of the serials, for more than one device.
        """
        super().__init__()
        if not 1 <= units <= MOST_BIRDS or range_inches <= 0.0:
            raise ValueError(
                f"units={units} is not 1 to {MOST_BIRDS}, or range_inches not positive"
            )
        self._port, self._baud, self._units, self._prefix = port, baud, units, prefix
        self._range_m = range_inches * METRES_PER_INCH
        self._R_world_source, self._hemisphere = source_axes(up), hemisphere
        self._invert, self._reset = invert, reset

    @classmethod
    def probe(cls) -> Probe:
        """Whether pyserial is here."""
        return probe_library("serial", "pyserial", "hid")

    def _connect(self) -> RecordSource[FlockRecord]:
        link = SerialLink(self._port, self._baud)
        try:
            return self._started(link)
        except Exception:
            link.close()
            raise

    def _started(self, link: SerialLink) -> RecordSource[FlockRecord]:
        if self._reset:
            link.set_rts(True)
            time.sleep(RESET_S[0])
        link.set_rts(False)  # a flock with this wire runs only while it is low
        if self._reset:
            time.sleep(RESET_S[1])
        grouped = self._units > 1
        birds = self._birds(link) if grouped else []
        length = RECORD_BYTES + 1 if grouped else RECORD_BYTES
        source = RecordSource(
            link, length, parse_grouped if grouped else parse_single, self._reading
        )
        if source.start([POINT], setup_commands(birds, self._hemisphere)):
            return source
        raise TrackerNotFound(
            f"no record of a flock came from {self._port} in 2 s: check that the birds' switches "
            f"are on FLY, that a sensor is plugged in, units={self._units} and baud={self._baud}"
        )

    def _birds(self, link: SerialLink) -> list[int]:
        """Make the units one flock, and ask which of them have a sensor."""
        link.write(POINT)
        link.quiet()
        time.sleep(CONFIGURING_S)
        link.write(auto_configure(self._units))
        time.sleep(CONFIGURING_S)
        link.write(ASK_STATUS)
        status = b""
        for _ in range(STATUS_READS):
            status += link.read()
            if len(status) >= MOST_BIRDS:
                break
        birds = birds_with_sensor(status[: self._units])
        if not birds:
            raise TrackerNotFound(
                f"no bird with a sensor answers on {self._port}: check that the switches are on "
                f"FLY, units={self._units} and baud={self._baud}"
            )
        return birds

    def _reading(self, record: FlockRecord) -> Reading:
        quat_wxyz = record.quat_wxyz * [1, -1, -1, -1] if self._invert else record.quat_wxyz
        pose = world_pose(self._R_world_source, record.p * self._range_m, quat_wxyz)
        return Reading(f"{self._prefix}-{record.address}", pose)

    def _info(self, serial: str) -> DeviceInfo:
        return DeviceInfo(serial, "tracker", "Ascension Flock of Birds")
