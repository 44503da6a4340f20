"""Replay: a recorded tracker log as a driver like the others."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind, Probe, TrackerDriver
from lobstr_hw.drivers.tracker_log import TrackerLog, TrackerTrack, read_log
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

__all__ = ["ReplayDriver"]

_KINDS = {
    TrackerRole.HEAD: "headset",
    TrackerRole.LEFT_HAND: "controller",
    TrackerRole.RIGHT_HAND: "controller",
}


class ReplayDriver(TrackerDriver):
    """Gives a log's samples at their own times, which begin at 0 with the first message.

    How fast it goes is up to whoever polls: time comes as ``now_s`` only. Everything stands in the
    log: a loss is a sample with ``tracked`` False, a broken number a NaN in a pose; buttons and
    commands come again, and the play space is set up anew at the same moment.
    """

    options: ClassVar = {"file": str}
    """What ``--driver replay:...`` understands, and how it is read."""

    def __init__(self, file: str | Path) -> None:
        """Remember the path; nothing is read before ``open``."""
        self.path = Path(file)
        self._log: TrackerLog | None = None
        self._samples: Iterator[TrackerSample] = iter(())
        self._next: TrackerSample | None = None
        self._events: list[DeviceEvent] = []
        self._now_s = 0.0

    @classmethod
    def probe(cls) -> Probe:
        """Reading a file needs nothing."""
        return Probe(available=True)

    def open(self) -> None:
        """Read the log.

        Raises:
            LogFileError: no such file, not a log, or no tracker in it.
        """
        self._log = read_log(self.path, skeleton=False)
        self._samples = self._log.samples()
        self._next = next(self._samples, None)
        self._events = _all_events(self._log)
        self._now_s = 0.0

    @property
    def log(self) -> TrackerLog:
        """What is being replayed, without its skeletons; between open and close."""
        if self._log is None:
            raise RuntimeError("the replay driver is not open")
        return self._log

    @property
    def duration_s(self) -> float:
        """Time of the last sample."""
        return self.log.duration_s

    def finished(self, now_s: float) -> bool:
        """Nothing comes after ``now_s``."""
        return self._log is None or now_s >= self._log.duration_s

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """The samples of the log up to now_s, oldest first."""
        due = []
        while self._next is not None and self._next.time_s <= now_s:
            due.append(self._next)
            self._next = next(self._samples, None)
        self._now_s = max(self._now_s, now_s)
        return due

    def devices(self) -> Sequence[DeviceInfo]:
        """All trackers of the log, with the battery at the time last polled."""
        if self._log is None:
            return ()
        return [_device(track, self._now_s) for track in self._log.trackers]

    def events(self) -> Sequence[DeviceEvent]:
        """Buttons, disappearances and what else happened, up to the time last polled."""
        due = [event for event in self._events if event.time_s <= self._now_s]
        self._events = self._events[len(due) :]
        return due

    def close(self) -> None:
        """Forget the log; twice is harmless."""
        self._log = None
        self._samples, self._next, self._events = iter(()), None, []


def _device(track: TrackerTrack, now_s: float) -> DeviceInfo:
    role = track.role
    kind = "tracker" if role is None else _KINDS.get(role, "tracker")
    battery = track.device_at(now_s).battery
    return DeviceInfo(track.serial, kind, model="replay", role_hint=role, battery=battery)


def _all_events(log: TrackerLog) -> list[DeviceEvent]:
    events = [*log.events, *(event for track in log.trackers for event in _events_of(track))]
    return sorted(events, key=lambda event: event.time_s)


def _events_of(track: TrackerTrack) -> Iterator[DeviceEvent]:
    buttons: set[str] = set()
    gone = False
    for change in track.states:
        held, now_gone = set(change.device.buttons), change.device.state is TrackingState.GONE
        if now_gone != gone:
            kind = EventKind.GONE if now_gone else EventKind.BACK
            yield DeviceEvent(kind, track.serial, change.time_s)
        for name in sorted(buttons - held):
            yield DeviceEvent(EventKind.BUTTON_UP, track.serial, change.time_s, name)
        for name in sorted(held - buttons):
            yield DeviceEvent(EventKind.BUTTON_DOWN, track.serial, change.time_s, name)
        buttons, gone = held, now_gone
