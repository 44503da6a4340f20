"""Several drivers as one: parts of the body may come from different devices."""

from collections.abc import Sequence
from contextlib import ExitStack

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, TrackerDriver
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.trackers import TrackerSample

__all__ = ["ManyDrivers"]


class ManyDrivers(TrackerDriver):
    """Opens, polls and closes drivers together; samples are merged by their time.

    Attributes:
        parts: the drivers; each has a name and a tracking space of its own.
    """

    def __init__(self, parts: Sequence[PartDriver]) -> None:
        """Choose the drivers; earlier ones come first where times are equal."""
        self.parts = tuple(parts)
        for part in self.parts:
            part.taken = {other.role for other in self.parts if other is not part and other.role}

    def space_of(self, serial: str) -> str | None:
        """The name of the part that a serial belongs to; None before it was seen."""
        return next((part.name for part in self.parts if part.has(serial)), None)

    def open(self) -> None:
        """Open all of them, or none: when one fails, those before it are closed again."""
        with ExitStack() as opened:
            for part in self.parts:
                opened.enter_context(part)
            opened.pop_all()

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """All samples up to now_s, oldest first."""
        samples = [sample for part in self.parts for sample in part.poll(now_s)]
        return sorted(samples, key=lambda sample: sample.time_s)  # stable

    def devices(self) -> Sequence[DeviceInfo]:
        """The devices of all drivers."""
        return [device for part in self.parts for device in part.devices()]

    def events(self) -> Sequence[DeviceEvent]:
        """What happened anywhere, oldest first."""
        events = [event for part in self.parts for event in part.events()]
        return sorted(events, key=lambda event: event.time_s)

    def close(self) -> None:
        """Close all of them."""
        for part in reversed(self.parts):
            part.close()
