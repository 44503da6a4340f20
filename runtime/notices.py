"""A driver's words for whoever uses it: a base station was moved, what to do at first use."""

from collections.abc import Iterable

from lobstr_hw.drivers.driver import DeviceEvent, EventKind

__all__ = ["notices"]


def notices(events: Iterable[DeviceEvent]) -> list[str]:
    """The words among the events, oldest first."""
    return [event.name for event in events if event.kind is EventKind.NOTICE]
