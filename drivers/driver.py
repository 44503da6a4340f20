"""The driver contract: a source of tracker samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import TracebackType
from typing import Self

from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["BASE_STATION", "DeviceEvent", "DeviceInfo", "EventKind", "Probe", "TrackerDriver"]


@dataclass(frozen=True, slots=True)
class Probe:
    """Whether a driver could run here: found out without opening anything."""

    available: bool
    missing: str = ""
    fix: str = ""


BASE_STATION = "base_station"
"""The kind of a device that others measure themselves by: it is listed and gives no samples."""


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """One device of a driver.

    Attributes:
        serial: names it.
        kind: headset, controller, tracker, base_station.
        model: as its maker calls it.
        role_hint: the body part it says, or was told, it stands for.
        firmware: its version.
        battery: 0 to 1, or None: it has none, or does not say.
        worn: of a headset.
        stations_in_view: how many base stations it sees now; None: that is not how it is tracked.
        sensors_hit: how many of its sensors see their light.
    """

    serial: str
    kind: str
    model: str = ""
    role_hint: TrackerRole | None = None
    firmware: str = ""
    battery: float | None = None
    worn: bool | None = None
    stations_in_view: int | None = None
    sensors_hit: int | None = None


class EventKind(StrEnum):
    """What happened to a device."""

    BUTTON_DOWN = "button_down"
    BUTTON_UP = "button_up"
    GONE = "gone"
    BACK = "back"
    RECENTRED = "recentred"
    COMMAND = "command"
    NOTICE = "notice"
    """Words for the user: what the driver found out, or what to do."""


@dataclass(frozen=True, slots=True)
class DeviceEvent:
    """Something that happened; ``name`` is the button, the command, or a notice's words."""

    kind: EventKind
    serial: str
    time_s: float
    name: str = ""


class TrackerDriver:
    """A source of tracker samples; ``with driver:`` opens and closes it.

    Time reaches a driver only as ``now_s``, so a replay can run as fast as it likes. Results depend
    on device time, never on when a packet happened to arrive. A driver knows serials; roles come
    from the profile, above it.
    """

    @classmethod
    def probe(cls) -> Probe:
        """Tell what is missing, opening nothing."""
        raise NotImplementedError

    def open(self) -> None:
        """Claim the devices.

        Raises:
            DeviceBusy, TrackerNotFound, DriverUnavailable: here and nowhere else.
        """
        raise NotImplementedError

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """Samples measured up to now_s and not given before, oldest first.

        Never blocks and never raises for a lost device: out of sight is ``tracked`` False, a pulled
        plug one sample with state gone.
        """
        raise NotImplementedError

    def devices(self) -> Sequence[DeviceInfo]:
        """The devices seen so far."""
        raise NotImplementedError

    def events(self) -> Sequence[DeviceEvent]:
        """What happened since the last call."""
        raise NotImplementedError

    def close(self) -> None:
        """Release the devices; twice is harmless; never raises."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        """Open."""
        self.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close, whatever happened."""
        self.close()
