"""All Lighthouse devices on USB as one source of readings.

A thread for each device follows it (device_session.py), another looks for devices that were plugged
in. What happens comes together in one inbox, and whoever reads the source, one thread, sorts it:
readings go on, what concerns the base stations goes to their desk.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Event, Lock, Thread
from time import monotonic

from lobstr_hw.drivers.lighthouse.angles import DeviceModel, StationCalibration
from lobstr_hw.drivers.lighthouse.device_follower import Heard, News, Seen
from lobstr_hw.drivers.lighthouse.device_session import DeviceSession
from lobstr_hw.drivers.lighthouse.sight import Sight
from lobstr_hw.drivers.lighthouse.station_desk import StationDesk
from lobstr_hw.drivers.lighthouse.transport import Transport, UsbDeviceInfo
from lobstr_hw.drivers.lighthouse.usb_ids import DeviceKind
from lobstr_hw.drivers.reading_thread import Arrival, Notice, Recentred
from lobstr_hw.errors import DriverError, DriverUnavailable, TrackerNotFound

__all__ = ["DeviceAbout", "Hub"]

READ_S = 0.05
LOOK_S = 1.0
"""Between two looks at what is plugged in: quick for a person; some milliseconds of work."""
SECOND_LOOK = 0.2
"""Of that, until what is new is looked at again: interfaces and leave to use them come one by one,
and only what two looks in a row found alike is opened."""
SETTLE_S, CLOSE_S = 3.0, 5.0
"""By then every device has said what it is, by cable or behind a dongle; or is let go of."""
NOT_FOUND = (
    "no Lighthouse device on USB. Plug in a headset, or a wand, tracker or Knuckles by cable, or "
    "the dongle of one that is switched on"
)

Listed = dict[str, UsbDeviceInfo]
"""What is plugged in, by its key."""


@dataclass(frozen=True, slots=True, eq=False)
class DeviceAbout:
    """A device that is there.

    Attributes:
        model: from its configuration.
        firmware: its version, or empty.
        battery: 0 to 1, or None.
        sight: what it sees.
    """

    model: DeviceModel
    firmware: str
    battery: float | None
    sight: Sight | None


class Hub:
    """Open devices; keeps to ``Source``."""

    def __init__(self, transport: Transport, stations: Path | None) -> None:
        """Claim what is plugged in, and wait until it has said what it is.

        Args:
            transport: how devices are reached.
            stations: file of the base stations, or None.

        Raises:
            TrackerNotFound: nothing is plugged in.
            DeviceBusy, DriverUnavailable: of the first device, where none can be opened.
            StationFileError: the file cannot be used.
        """
        self._transport = transport
        self._inbox: SimpleQueue[News] = SimpleQueue()
        self._sessions: dict[str, DeviceSession] = {}
        self._lock = Lock()
        self._stop = Event()
        self._refused: dict[str, DriverError] = {}
        self._desk = StationDesk(stations, self._tell, self._stations_changed)
        self._told: set[str] = set()
        self._numbers = count()  # of a device's clocks: what is plugged in anew has another one
        self._looking = Thread(target=self._look_again, name="lobstr-plugs", daemon=True)
        try:
            listed = self._listed()
            self._open_new(listed, listed)
            if not self._sessions:
                raise next(iter(self._refused.values()), TrackerNotFound(NOT_FOUND))
            for error in self._refused.values():
                self._tell(f"{error}; going on without it.")
            self._settle()
            self._looking.start()
        except BaseException:  # also Ctrl-C while devices are opened and asked
            self.close()
            raise

    def read(self) -> Sequence[Arrival]:
        """What happened; waits a moment for something to happen."""
        arrivals: list[Arrival] = []
        try:
            arrivals += self._sort(self._inbox.get(timeout=READ_S))
            for _ in range(self._inbox.qsize()):
                arrivals += self._sort(self._inbox.get_nowait())
        except Empty:
            pass
        self._desk.work()
        for session in self._open():
            session.surveyed = self._desk.surveying
        return arrivals

    def _sort(self, news: News) -> list[Arrival]:
        match news:
            case Heard(number, calibration):
                self._desk.hear(number, calibration)
            case Seen(serial, model, decoded):
                self._desk.see(serial, model, decoded)
            case _:
                return [news]
        return []

    def about(self) -> list[DeviceAbout]:
        """The devices that are there, by what they say."""
        found = []
        for session in self._open():
            about, tracked, sight = session.about, session.tracked, session.sight
            if about is not None:
                battery = tracked.reader.battery if tracked else None
                found.append(DeviceAbout(about.model, about.firmware, battery, sight))
        return found

    def stations(self) -> dict[int, StationCalibration]:
        """The stations that are known or heard, by number."""
        known = {n: s.calibration for n, s in self._desk.stations.items()}
        return known | dict(self._desk.heard)

    def close(self) -> None:
        """Let go of all devices, of all at once; never raises."""
        end_s = monotonic() + CLOSE_S
        self._stop.set()
        for session in self._open():
            session.stop()
        if self._looking.is_alive():
            self._looking.join(timeout=CLOSE_S)
        for session in self._open():
            session.close(max(0.0, end_s - monotonic()))

    def _open(self) -> list[DeviceSession]:
        with self._lock:
            return list(self._sessions.values())

    def _tell(self, text: str) -> None:
        self._inbox.put(Notice(text))

    def _stations_changed(self, same_world: bool) -> None:
        with self._lock:
            for session in self._sessions.values():
                session.use_stations(self._desk.stations, same_world)
        if not same_world:
            self._inbox.put(Recentred())

    def _settle(self) -> None:
        end_s = monotonic() + SETTLE_S
        for session in self._open():
            session.settled.wait(max(0.0, end_s - monotonic()))

    def _look_again(self) -> None:
        before: Listed = {}
        wait_s = LOOK_S
        while not self._stop.wait(wait_s):
            wait_s = LOOK_S
            with suppress(DriverError, OSError):
                listed = self._listed()
                for info in self._open_new(listed, before):
                    self._tell(f"{self._refused[info.key]}; going on without it.")
                wait_s *= 1.0 if listed == before else SECOND_LOOK
                before = listed

    def _listed(self) -> Listed:
        return {info.key: info for info in self._transport.enumerate()}

    def _open_new(self, listed: Listed, before: Listed) -> list[UsbDeviceInfo]:
        """Open what is new and listed as before; returns what could not be opened, each once."""
        for key in [key for key in self._refused if key not in listed]:
            del self._refused[key]
        with self._lock:
            for key in [key for key, s in self._sessions.items() if s.ended.is_set()]:
                del self._sessions[key]
        refused = []
        for key, info in listed.items():
            if key in self._sessions or info.kind is DeviceKind.BOARD or before.get(key) != info:
                continue
            try:
                self._begin(info)
            except DriverError as error:
                if key not in self._refused:
                    refused.append(info)
                self._refused[key] = error
            else:
                self._refused.pop(key, None)
        return refused

    def _begin(self, info: UsbDeviceInfo) -> None:
        if info.kind is DeviceKind.UNKNOWN:
            raise DriverUnavailable(f"{info.name} is of an unknown kind and left alone")
        device = self._transport.open(info)
        with self._lock:
            stations = self._desk.stations
            gen2 = any(s.calibration.generation == 2 for s in stations.values())
            self._sessions[info.key] = DeviceSession(
                device, stations, gen2, self._inbox.put, self._told, self._numbers
            )
