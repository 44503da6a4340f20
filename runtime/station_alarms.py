"""Base stations that went out: told by the driver, or by what all trackers see of them."""

from collections.abc import Sequence

from lobstr_hw.drivers.driver import BASE_STATION, DeviceEvent, DeviceInfo, EventKind
from lobstr_hw.runtime.announcer import Sound, Spoken

__all__ = ["StationAlarms"]

HIDDEN_S = 5.0
"""Bodies hide a station from every tracker for a moment."""
WHAT_TO_DO = "Is it switched on, and is nothing in front of it?"


class StationAlarms:
    """Told of events and devices now and then, says what is worth a word."""

    def __init__(self) -> None:
        """All is well, as far as is known."""
        self._stations: set[str] = set()
        self._most = 0
        self._fewer_since_s: float | None = None
        self._told = False

    def events(self, events: Sequence[DeviceEvent]) -> list[Spoken]:
        """Stations that their driver lost, and found again."""
        said = []
        for event in events:
            if event.serial not in self._stations:
                continue
            if event.kind is EventKind.GONE:
                words = f"Base station {event.serial} lost. {WHAT_TO_DO}"
                said.append(Spoken(words, Sound.TROUBLE))
            elif event.kind is EventKind.BACK:
                said.append(Spoken(f"Base station {event.serial} is back.", Sound.DONE))
        return said

    def devices(self, now_s: float, devices: Sequence[DeviceInfo]) -> list[Spoken]:
        """Stations that no tracker sees any more, where trackers say how many they see."""
        self._stations |= {d.serial for d in devices if d.kind == BASE_STATION}
        views = [d.stations_in_view for d in devices if d.stations_in_view is not None]
        seen = max(views, default=0)
        self._most = max(self._most, seen)
        if seen == self._most:
            return self._all_seen()
        self._fewer_since_s = now_s if self._fewer_since_s is None else self._fewer_since_s
        if self._told or now_s - self._fewer_since_s < HIDDEN_S:
            return []
        self._told = True
        words = f"Only {seen} of {self._most} base stations in sight. {WHAT_TO_DO}"
        return [Spoken(words, Sound.TROUBLE)]

    def _all_seen(self) -> list[Spoken]:
        self._fewer_since_s = None
        if not self._told:
            return []
        self._told = False
        return [Spoken(f"All {self._most} base stations in sight again.", Sound.DONE)]
