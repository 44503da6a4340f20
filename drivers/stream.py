"""What drivers of streaming devices share: times, losses, buttons, events.

A new driver says how to connect and what a record means (docs/writing-a-driver.md).
"""

from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from time import perf_counter

from lobstr_hw.drivers.device_clock import DeviceClock
from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind, TrackerDriver
from lobstr_hw.drivers.reading_thread import (
    QUEUE_LENGTH,
    Arrival,
    Command,
    LinkLost,
    Lost,
    Notice,
    Reading,
    ReadingThread,
    Recentred,
    Source,
)
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.poses import PartialPose
from lobstr_hw.trackers import TrackerSample, TrackingState

__all__ = ["StreamDriver"]

SILENCE_S = 1.0
"""A tracker that says nothing for this long is gone: the slowest of them send at 30 Hz."""
TRACKED = frozenset({TrackingState.OK, TrackingState.INERTIAL})


@dataclass(slots=True)
class _Tracker:
    """What is remembered of a tracker."""

    pose: PartialPose | None = None
    arrived_s: float = 0.0
    last_s: float = 0.0
    gone: bool = False
    buttons: frozenset[str] = field(default_factory=frozenset)


class StreamDriver(TrackerDriver):
    """A driver whose device sends on its own; a subclass has ``_connect`` and ``_info``.

    A device with a clock gives the samples' times (DeviceClock); of one without, a sample has the
    time at which the reading thread got it. Times of one clock never go back; trackers with clocks
    of their own may be told later one than the other. A word without a pose, such as a button, has
    its place among the events and moves no sample.
    """

    def __init__(self) -> None:
        """Nothing is open."""
        self._thread: ReadingThread | None = None
        self._clocks: defaultdict[str, DeviceClock] = defaultdict(DeviceClock)
        self._given_s: defaultdict[str, float] = defaultdict(float)  # by clock
        self._trackers: dict[str, _Tracker] = {}
        self._events: list[DeviceEvent] = []
        self._waiting: deque[tuple[float, Arrival]] = deque(maxlen=QUEUE_LENGTH)
        self._now_s = self._lead_s = -float("inf")
        self._last_s = 0.0

    def _connect(self) -> Source:
        """Open the device and set it going; DeviceBusy, TrackerNotFound, DriverUnavailable."""
        raise NotImplementedError

    def _info(self, serial: str) -> DeviceInfo:
        """Describe a tracker that was seen."""
        raise NotImplementedError

    def open(self) -> None:
        """Connect, then read in the background.

        Raises:
            DeviceBusy, TrackerNotFound, DriverUnavailable: as ``_connect`` has it.
        """
        self.close()
        self._begin()
        try:
            self._thread = ReadingThread(self._connect)
        except (LinkLost, OSError) as error:
            raise TrackerNotFound(f"the device went while it was set up: {error}") from error

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """What was measured by now and not given before; nothing for a time asked for already."""
        if self._thread is None or now_s <= self._now_s:
            return ()
        self._now_s = now_s
        # a tick may come late, never early: the earliest tells what perf_counter is on this clock
        self._lead_s = max(self._lead_s, now_s - perf_counter())
        for arrived_s, what in self._thread.take():
            if isinstance(what, Reading) and what.device_s is not None:
                self._clocks[what.clock].observe(what.device_s, arrived_s)
            self._waiting.append((arrived_s, what))
        samples: list[TrackerSample] = []
        while self._waiting and self._time(*self._waiting[0]) <= now_s:
            samples += self._heard(*self._waiting.popleft())
        return sorted(samples + self._silent(), key=lambda sample: sample.time_s)  # stable

    def devices(self) -> Sequence[DeviceInfo]:
        """The trackers seen since opening."""
        return [self._info(serial) for serial in self._trackers]

    def events(self) -> Sequence[DeviceEvent]:
        """Buttons, commands, disappearances and returns up to the time last polled."""
        events = tuple(self._events)
        self._events.clear()
        return events

    def close(self) -> None:
        """Stop the thread; twice is harmless."""
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.close()
        self._begin()

    def _begin(self) -> None:
        self._clocks.clear()
        self._given_s.clear()
        self._trackers.clear()
        self._events.clear()
        self._waiting.clear()
        self._now_s = self._lead_s = -float("inf")
        self._last_s = 0.0

    def _time(self, arrived_s: float, what: Arrival) -> float:
        """When it was measured: no later than it arrived, no earlier than what was given before."""
        if not isinstance(what, Reading):
            return max(self._last_s, arrived_s + self._lead_s)
        if what.T_world_tracker is None and what.device_s is None:
            return max(self._last_s, arrived_s + self._lead_s)
        measured_s, tracker = arrived_s, self._trackers.get(what.serial)
        if what.device_s is not None:
            measured_s = min(arrived_s, self._clocks[what.clock].host_s(what.device_s))
        last_s = 0.0 if tracker is None else tracker.last_s
        return max(last_s, self._given_s[what.clock], measured_s + self._lead_s)

    def _heard(self, arrived_s: float, what: Arrival) -> list[TrackerSample]:
        time_s = self._time(arrived_s, what)
        self._last_s = max(self._last_s, time_s)
        match what:
            case Reading():
                return self._read(what, arrived_s, time_s)
            case Lost(serial):
                serials = list(self._trackers) if serial is None else [serial]
                return [sample for one in serials for sample in self._lose(one, time_s)]
            case Command(name):
                self._events.append(DeviceEvent(EventKind.COMMAND, "", time_s, name))
            case Notice(text):
                self._events.append(DeviceEvent(EventKind.NOTICE, "", time_s, text))
            case Recentred():
                self._events.append(DeviceEvent(EventKind.RECENTRED, "", time_s))
        return []

    def _read(self, reading: Reading, arrived_s: float, time_s: float) -> list[TrackerSample]:
        tracker = self._trackers.setdefault(reading.serial, _Tracker())
        tracker.arrived_s = arrived_s
        if reading.T_world_tracker is not None:
            tracker.last_s = self._given_s[reading.clock] = time_s
        if tracker.gone:
            tracker.gone = False
            self._events.append(DeviceEvent(EventKind.BACK, reading.serial, time_s))
        self._press(reading, tracker, time_s)
        if reading.T_world_tracker is None:
            return []
        tracker.pose = reading.T_world_tracker
        tracked = reading.state in TRACKED
        return [
            TrackerSample(
                reading.serial, tracker.pose, time_s, tracked, reading.state,
                reading.velocity, reading.covariance,
            )
        ]  # fmt: skip

    def _press(self, reading: Reading, tracker: _Tracker, time_s: float) -> None:
        if reading.buttons is None:
            return
        up, down = tracker.buttons - reading.buttons, reading.buttons - tracker.buttons
        for kind, names in ((EventKind.BUTTON_UP, up), (EventKind.BUTTON_DOWN, down)):
            for name in sorted(names):
                self._events.append(DeviceEvent(kind, reading.serial, time_s, name))
        tracker.buttons = reading.buttons

    def _silent(self) -> list[TrackerSample]:
        """One second without a word; not while words wait for their time to come."""
        since_s = self._now_s - self._lead_s - SILENCE_S
        quiet = [s for s, t in self._trackers.items() if t.arrived_s < since_s and not t.gone]
        if not quiet or self._waiting:
            return []
        self._last_s = self._now_s
        return [sample for serial in quiet for sample in self._lose(serial, self._now_s)]

    def _lose(self, serial: str, time_s: float) -> list[TrackerSample]:
        tracker = self._trackers.get(serial)
        if tracker is None or tracker.gone:
            return []
        tracker.gone = True
        tracker.last_s = time_s = max(time_s, tracker.last_s)
        self._events.append(DeviceEvent(EventKind.GONE, serial, time_s))
        for name in sorted(tracker.buttons):  # nobody can let go of a button that is not there
            self._events.append(DeviceEvent(EventKind.BUTTON_UP, serial, time_s, name))
        tracker.buttons = frozenset()
        if tracker.pose is None:
            return []
        return [TrackerSample(serial, tracker.pose, time_s, False, TrackingState.GONE)]
