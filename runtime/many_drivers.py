"""Several drivers as one: parts of the body may come from different devices."""

from collections.abc import Sequence
from contextlib import ExitStack

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, TrackerDriver
from lobstr_hw.trackers import TrackerSample

__all__ = ["ManyDrivers"]


class ManyDrivers(TrackerDriver):
    """Opens, polls and closes drivers together; samples are merged by their time."""

    def __init__(self, drivers: Sequence[TrackerDriver]) -> None:
        """Choose the drivers; earlier ones come first where times are equal."""
        self._drivers = tuple(drivers)

    def open(self) -> None:
        """Open all of them, or none: when one fails, those before it are closed again."""
        with ExitStack() as opened:
            for driver in self._drivers:
                opened.enter_context(driver)
            opened.pop_all()

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """All samples up to now_s, oldest first."""
        samples = [sample for driver in self._drivers for sample in driver.poll(now_s)]
        return sorted(samples, key=lambda sample: sample.time_s)  # stable

    def devices(self) -> Sequence[DeviceInfo]:
        """The devices of all drivers."""
        return [device for driver in self._drivers for device in driver.devices()]

    def events(self) -> Sequence[DeviceEvent]:
        """What happened anywhere, oldest first."""
        events = [event for driver in self._drivers for event in driver.events()]
        return sorted(events, key=lambda event: event.time_s)

    def close(self) -> None:
        """Close all of them."""
        for driver in reversed(self._drivers):
            driver.close()
