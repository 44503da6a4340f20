"""Looking at what is plugged in: one thread for each driver, so that none holds up the others."""

import inspect
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass

from lobstr_hw.drivers import driver_class, load_driver, split_driver_spec
from lobstr_hw.drivers.driver import DeviceInfo, Probe, TrackerDriver
from lobstr_hw.errors import DriverUnavailable, LobstrError
from lobstr_hw.runtime.clock import Clock
from lobstr_hw.runtime.notices import notices
from lobstr_hw.runtime.station_place import with_station_file
from lobstr_hw.trackers import TrackerRole, TrackingState

__all__ = ["UNASKED", "DeviceReport", "DeviceWatch", "DriverReport", "merged"]

UNASKED = frozenset({"fake", "lighthouse", "openvr", "vmc"})
"""Drivers that may be opened just to look: they take nothing away from another program. All others
are opened when the user names them: a serial port may have something else at its other end, and a
session of OpenXR starts its runtime."""

LISTEN_S = 0.5
"""Devices that send on their own are heard of within this time; the slowest send at 30 Hz."""
ANSWER_S = 5.0
"""A driver that has not answered by then hangs; a Polhemus may take 2.5 s to begin."""
RETRY_S = 2.0
POLL_S = 0.05

UNPLUG = "end other programs that use the device, plug it in anew, try again"
REPORT_IT = "a fault of this driver: report it with these words"

Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """One device: what the driver says of it, and the state of its newest sample, if any."""

    serial: str
    kind: str
    model: str
    role_hint: TrackerRole | None
    firmware: str
    battery: float | None
    worn: bool | None
    stations_in_view: int | None
    sensors_hit: int | None
    state: TrackingState | None


@dataclass(frozen=True, slots=True)
class DriverReport:
    """One driver.

    Attributes:
        name: in the table of drivers.
        available: it can run here.
        missing: what it lacks, or what went wrong; "" where all is well.
        fix: what to do about it, a command where there is one.
        devices: those it sees now.
    """

    name: str
    available: bool
    missing: str = ""
    fix: str = ""
    devices: tuple[DeviceReport, ...] = ()


class DeviceWatch:
    """One driver: probed, opened, and listened to until it is left.

    Attributes:
        report: the newest.
        settled: set once the report is worth reading.
    """

    def __init__(self, spec: str, asked: bool, clock: Clock, tell: Tell) -> None:
        """Get ready; nothing is loaded yet.

        Args:
            spec: NAME or NAME:key=value,...
            asked: the user named it, so it may be opened whatever it is.
            clock: what the driver is told of time.
            tell: is told, once, of what no driver should do.
        """
        self.name, _ = split_driver_spec(spec)
        self.report = DriverReport(self.name, False, f"no answer within {ANSWER_S:g} s", UNPLUG)
        self.settled = threading.Event()
        self._spec, self._opens = spec, asked or self.name in UNASKED
        self._clock, self._tell = clock, tell
        self._told: set[str] = set()
        self._states: dict[str, TrackingState] = {}
        self._end = threading.Event()
        # a daemon: one that hangs must not keep the program from ending
        self._thread = threading.Thread(target=self._run, name=f"watch-{spec}", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Ask it to close the driver."""
        self._end.set()

    def join(self, timeout_s: float) -> None:
        """Wait until the driver is closed, but not for ever."""
        self._thread.join(timeout_s)

    def _run(self) -> None:
        while not self._end.is_set():
            try:
                self._look()
            except LobstrError as error:
                self._failed(error)
            except Exception as error:  # a bug in one driver must not hide the others
                self._broke(error)
            self.settled.set()
            self._end.wait(RETRY_S)

    def _look(self) -> None:
        found = driver_class(self.name)
        probe = found.probe()
        if not probe.available or not self._opens:
            self.report = _of_probe(self.name, found, probe)
            return
        with load_driver(with_station_file(self._spec)) as driver:
            self._listen(driver)

    def _listen(self, driver: TrackerDriver) -> None:
        since_s = self._clock.now_s()
        self._states.clear()
        while not self._end.is_set():
            for sample in driver.poll(self._clock.now_s()):
                self._states[sample.serial] = sample.state
            for words in notices(driver.events()):
                self._tell_once(words, f"{self.name}: {words}")
            self.report = DriverReport(self.name, True, devices=self._devices(driver.devices()))
            if self._clock.now_s() - since_s >= LISTEN_S:
                self.settled.set()
            self._end.wait(POLL_S)

    def _devices(self, devices: Iterable[DeviceInfo]) -> tuple[DeviceReport, ...]:
        state = self._states.get
        return tuple(DeviceReport(**asdict(d), state=state(d.serial)) for d in devices)

    def _failed(self, error: LobstrError) -> None:
        """Messages say what was seen, then what to do."""
        available = not isinstance(error, DriverUnavailable)
        missing, _, fix = str(error).partition(". ")
        self.report = DriverReport(self.name, available, missing, fix)

    def _broke(self, error: Exception) -> None:
        text = f"{type(error).__name__}: {error}"
        self.report = DriverReport(self.name, False, f"it failed ({text})", REPORT_IT)
        self._tell_once(text, f"the driver {self.name} failed ({text}); going on without it.")

    def _tell_once(self, what: str, words: str) -> None:
        if what not in self._told:
            self._told.add(what)
            self._tell(words)


def _of_probe(name: str, found: type[TrackerDriver], probe: Probe) -> DriverReport:
    """Of a driver that is not opened."""
    if not probe.available:
        return DriverReport(name, False, probe.missing, probe.fix)
    options = ",".join(f"{key}=..." for key in _needed(found))
    spec = f"{name}:{options}" if options else name
    return DriverReport(name, True, "", f"lobstr-devices --driver {spec}")


def _needed(found: type[TrackerDriver]) -> list[str]:
    """The options to name: those without a default, and the port, which is seldom the right one."""
    known = inspect.signature(found).parameters.values()
    return [
        option.name
        for option in known
        if option.name == "port"
        or (option.default is option.empty and option.kind is option.POSITIONAL_OR_KEYWORD)
    ]


def merged(watches: Sequence[DeviceWatch]) -> list[DriverReport]:
    """One report for each driver by name, in the order of the watches."""
    reports: dict[str, DriverReport] = {}
    for report in (watch.report for watch in watches):
        before = reports.get(report.name)
        reports[report.name] = report if before is None else _joined(before, report)
    return list(reports.values())


def _joined(a: DriverReport, b: DriverReport) -> DriverReport:
    return DriverReport(
        a.name,
        a.available or b.available,
        "; ".join(filter(None, (a.missing, b.missing))),
        "; ".join(filter(None, (a.fix, b.fix))),
        a.devices + b.devices,
    )
