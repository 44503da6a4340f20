"""A thread that reads a device, so that nobody else waits for it."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event, Thread
from time import perf_counter
from typing import Protocol

from lobstr_hw.errors import DriverError
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import TrackingState

__all__ = [
    "Arrival",
    "Command",
    "LinkLost",
    "Lost",
    "Notice",
    "Reading",
    "ReadingThread",
    "Recentred",
    "Source",
]

QUEUE_LENGTH = 4096
"""Two seconds of a headset at 1000 Hz and four devices at 250; the runtime keeps 0.3 s itself."""
RETRY_S = 0.5
"""How often a lost device is looked for: quick for a person, and nothing for the machine."""


class LinkLost(Exception):
    """The device is gone; seen by the reading thread only."""


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """What one record of a device says about one tracker.

    Attributes:
        serial: of the tracker.
        T_world_tracker: in our world already (docs/conventions.md), or None: nothing about a pose.
        state: anything but ok and inertial counts as not tracked.
        device_s: the device's own time, or None where it has no clock.
        buttons: those held down, or None: nothing about buttons.
        velocity: (3,) metres per second in our world, where the device knows it.
        covariance: (6, 6) of position and rotation in our world, where the device knows it.
        clock: which of the source's clocks ``device_s`` is of.
        arrived_s: its ``perf_counter``, where the source knows better than who hands it on.
    """

    serial: str
    T_world_tracker: PartialPose | None
    state: TrackingState = TrackingState.OK
    device_s: float | None = None
    buttons: frozenset[str] | None = None
    velocity: Array | None = None
    covariance: Array | None = None
    clock: str = ""
    arrived_s: float | None = None


@dataclass(frozen=True, slots=True)
class Command:
    """Somebody asks for something: calibrate, recentre, freeze, seat."""

    name: str


@dataclass(frozen=True, slots=True)
class Notice:
    """Words for whoever uses the device: what it found, or what to do."""

    text: str


@dataclass(frozen=True, slots=True)
class Recentred:
    """Where the origin of the world lies has changed."""


@dataclass(frozen=True, slots=True)
class Lost:
    """The device is gone, all trackers with it, or only the named one."""

    serial: str | None = None


Arrival = Reading | Command | Lost | Notice | Recentred


class Source(Protocol):
    """An open device."""

    def read(self) -> Sequence[Arrival]:
        """What came in; waits 0.1 s at most; LinkLost or OSError when the device is gone."""
        ...

    def close(self) -> None:
        """Let go of the device; never raises."""
        ...


class ReadingThread:
    """Fills a short queue that drops its oldest; looks for the device again when it is lost."""

    def __init__(self, connect: Callable[[], Source]) -> None:
        """Connect now, so that its errors reach the caller; then read in the background."""
        self._connect = connect
        self._source: Source | None = connect()
        self._arrivals: deque[tuple[float, Arrival]] = deque(maxlen=QUEUE_LENGTH)
        self._stop = Event()
        self._thread = Thread(target=self._run, name="lobstr-driver", daemon=True)
        self._thread.start()

    def take(self) -> list[tuple[float, Arrival]]:
        """All that came in since the last call, oldest first, each with its ``perf_counter``."""
        return [self._arrivals.popleft() for _ in range(len(self._arrivals))]

    def close(self) -> None:
        """Stop reading and let go of the device."""
        self._stop.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                if self._source is None:
                    self._look_again()
                else:
                    self._read(self._source)
        finally:
            self._put(Lost())  # also when a bug ends this thread: the loop sees it as a lost device
            if self._source is not None:
                self._source.close()

    def _read(self, source: Source) -> None:
        try:
            for arrival in source.read():
                self._put(arrival)
        except (LinkLost, OSError):
            self._source = None
            source.close()
            self._put(Lost())

    def _look_again(self) -> None:
        if self._stop.wait(RETRY_S):
            return
        try:
            self._source = self._connect()
        except (DriverError, LinkLost, OSError):
            self._source = None

    def _put(self, arrival: Arrival) -> None:
        known_s = arrival.arrived_s if isinstance(arrival, Reading) else None
        self._arrivals.append((perf_counter() if known_s is None else known_s, arrival))
