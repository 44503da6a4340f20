"""Everything that somebody in a headset is warned of, gathered: trackers, batteries, stations."""

from collections.abc import Sequence

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, TrackerDriver
from lobstr_hw.runtime.alarms import Alarms
from lobstr_hw.runtime.announcer import Spoken
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.session import Session
from lobstr_hw.runtime.slip_watch import SlipWatch
from lobstr_hw.runtime.start_watch import StartWatch
from lobstr_hw.runtime.station_alarms import StationAlarms
from lobstr_hw.trackers import TrackerSample

__all__ = ["Lookout"]

DEVICES_EVERY_S = 1.0


class Lookout:
    """Looks at every tick, says what is worth a word."""

    def __init__(self, driver: TrackerDriver, session: Session, feed: Feed) -> None:
        """Begin.

        Args:
            driver: open; lists its devices.
            session: its calibration is what trackers are compared with.
            feed: how each role fares.
        """
        self._driver, self._session, self._feed = driver, session, feed
        self._alarms, self._stations = Alarms(), StationAlarms()
        profile = session.calibration  # made before this session, so it may not fit any more
        self._start_watch = None if profile is None else StartWatch(profile)
        self._slip_watch = SlipWatch()
        self._next_devices_s = 0.0

    def world_moved(self, now_s: float) -> None:
        """Heights are others now: look anew."""
        if self._start_watch is not None and not self._start_watch.done:
            self._start_watch = StartWatch(self._session.aim, now_s)
        self._slip_watch = SlipWatch()

    def look(
        self, now_s: float, samples: Sequence[TrackerSample], events: Sequence[DeviceEvent]
    ) -> list[Spoken]:
        """What to say at this tick."""
        said = self._stations.events(events)
        if now_s >= self._next_devices_s:
            self._next_devices_s = now_s + DEVICES_EVERY_S
            said += self._look_at(self._driver.devices(), now_s)
        if self._session.calibrated:
            said += self._alarms.trackers(now_s, self._feed.report(now_s))
            said += self._slips(now_s, samples)
        return said

    def _look_at(self, devices: Sequence[DeviceInfo], now_s: float) -> list[Spoken]:
        said = self._stations.devices(now_s, devices)
        if self._session.calibrated:
            said += self._alarms.batteries(devices, self._session.roles)
            said += self._alarms.roles(devices, self._session.roles)
        return said

    def _slips(self, now_s: float, samples: Sequence[TrackerSample]) -> list[Spoken]:
        """At the start within a second; later only what stays wrong."""
        if self._start_watch is not None and not self._start_watch.done:
            return self._start_watch.add(now_s, samples)
        return self._slip_watch.add(now_s, samples, self._session.aim)
