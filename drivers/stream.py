"""What drivers of streaming devices share: times, losses, buttons, events.

A new driver says how to connect and what a record means (docs/writing-a-driver.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from lobstr_hw.drivers.device_clock import DeviceClock
from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind, TrackerDriver
from lobstr_hw.drivers.reading_thread import (
    Command,
    LinkLost,
    Lost,
    Reading,
    ReadingThread,
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
    gone: bool = False
    buttons: frozenset[str] = field(default_factory=frozenset)


class StreamDriver(TrackerDriver):
    """A driver whose device sends on its own; a subclass has ``_connect`` and ``_info``.

    A device with a clock gives the samples' times (DeviceClock); of one without, a sample has the
    time at which the reading thread got it.
    """

    def __init__(self) -> None:
        """Nothing is open."""
        self._thread: ReadingThread | None = None
        self._clock = DeviceClock()
        self._trackers: dict[str, _Tracker] = {}
        self._events: list[DeviceEvent] = []
        self._now_s, self._last_s = -float("inf"), 0.0

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
        """What came in since the last poll; nothing for a time that was asked for already."""
        if self._thread is None or now_s <= self._now_s:
            return ()
        self._now_s = now_s
        arrivals = [(now_s - max(age_s, 0.0), what) for age_s, what in self._thread.take()]
        for arrived_s, what in arrivals:
            if isinstance(what, Reading) and what.device_s is not None:
                self._clock.observe(what.device_s, arrived_s)
        samples: list[TrackerSample] = []
        for arrived_s, what in arrivals:
            samples += self._heard(what, arrived_s)
        samples += self._silent()
        return samples

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
        self._clock = DeviceClock()
        self._trackers.clear()
        self._events.clear()
        self._now_s, self._last_s = -float("inf"), 0.0

    def _time(self, time_s: float) -> float:
        """No newer than now and no older than the last sample: a new offset must not step back."""
        self._last_s = max(self._last_s, min(time_s, self._now_s))
        return self._last_s

    def _heard(self, what: Reading | Command | Lost, arrived_s: float) -> list[TrackerSample]:
        if isinstance(what, Reading):
            device_s = what.device_s
            time_s = arrived_s if device_s is None else self._clock.host_s(device_s)
            return self._read(what, arrived_s, self._time(time_s))
        time_s = self._time(arrived_s)
        if isinstance(what, Command):
            self._events.append(DeviceEvent(EventKind.COMMAND, "", time_s, what.name))
            return []
        if what.serial is None:
            self._clock = DeviceClock()
        serials = self._trackers if what.serial is None else [what.serial]
        return [sample for serial in serials for sample in self._lose(serial, time_s)]

    def _read(self, reading: Reading, arrived_s: float, time_s: float) -> list[TrackerSample]:
        tracker = self._trackers.setdefault(reading.serial, _Tracker())
        tracker.arrived_s = arrived_s
        if tracker.gone:
            tracker.gone = False
            self._events.append(DeviceEvent(EventKind.BACK, reading.serial, time_s))
        self._press(reading, tracker, time_s)
        if reading.T_world_tracker is None:
            return []
        tracker.pose = reading.T_world_tracker
        tracked = reading.state in TRACKED
        return [TrackerSample(reading.serial, tracker.pose, time_s, tracked, reading.state)]

    def _press(self, reading: Reading, tracker: _Tracker, time_s: float) -> None:
        if reading.buttons is None:
            return
        up, down = tracker.buttons - reading.buttons, reading.buttons - tracker.buttons
        for kind, names in ((EventKind.BUTTON_UP, up), (EventKind.BUTTON_DOWN, down)):
            for name in sorted(names):
                self._events.append(DeviceEvent(kind, reading.serial, time_s, name))
        tracker.buttons = reading.buttons

    def _silent(self) -> list[TrackerSample]:
        quiet = [s for s, t in self._trackers.items() if self._now_s - t.arrived_s > SILENCE_S]
        time_s = self._time(self._now_s) if quiet else 0.0
        return [sample for serial in quiet for sample in self._lose(serial, time_s)]

    def _lose(self, serial: str, time_s: float) -> list[TrackerSample]:
        tracker = self._trackers.get(serial)
        if tracker is None or tracker.gone:
            return []
        tracker.gone = True
        self._events.append(DeviceEvent(EventKind.GONE, serial, time_s))
        for name in sorted(tracker.buttons):  # nobody can let go of a button that is not there
            self._events.append(DeviceEvent(EventKind.BUTTON_UP, serial, time_s, name))
        tracker.buttons = frozenset()
        if tracker.pose is None:
            return []
        return [TrackerSample(serial, tracker.pose, time_s, False, TrackingState.GONE)]
