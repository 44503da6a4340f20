"""Vive and Index hardware straight from USB, without SteamVR.

lobstr-live --driver lighthouse
lobstr-live --driver lighthouse:pelvis=LHR-1A2B3C4D,stations=room.json
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from lobstr_hw.drivers.chosen_roles import ROLE_OPTIONS, by_serial, hint
from lobstr_hw.drivers.driver import BASE_STATION, DeviceEvent, DeviceInfo, EventKind, Probe
from lobstr_hw.drivers.lighthouse.hub import DeviceAbout, Hub
from lobstr_hw.drivers.lighthouse.raw_recording import RawRecording
from lobstr_hw.drivers.lighthouse.steamvr import steamvr_runs
from lobstr_hw.drivers.lighthouse.survey import station_name
from lobstr_hw.drivers.lighthouse.transport import Transport
from lobstr_hw.drivers.lighthouse.transports import (
    available_transports,
    check_name,
    choose_transport,
)
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.drivers.vendor import probe_library
from lobstr_hw.errors import (
    DeviceBusy,
    DriverUnavailable,
    OutputError,
    StationFileError,
)
from lobstr_hw.trackers import TrackerRole

__all__ = ["LighthouseDriver"]

KINDS = {"hmd": "headset", "controller": "controller", "generic_tracker": "tracker"}
"""What devices call themselves."""


class LighthouseDriver(StreamDriver):
    """Headsets, controllers and trackers, each as soon as it is plugged in or switched on."""

    options: ClassVar[Mapping[str, Callable[[str], object]]] = {
        **ROLE_OPTIONS,
        "stations": Path,
        "transport": str,
        "raw": Path,
    }
    """What ``--driver lighthouse:...`` understands, and how it is read."""

    def __init__(
        self,
        stations: Path | None = None,
        transport: str | Transport | None = None,
        raw: Path | None = None,
        **serials: str,
    ) -> None:
        """Choose how to reach devices.

        Args:
            stations: file of the base stations; it is written when they are found. None: they are
                found anew each time.
            transport: name of a way to USB, or one that is open to use; None: the best there is.
            raw: a capture to write of all that goes over USB, for ``lobstr-log import``.
            serials: the serial that stands for each role.

        Raises:
            ValueError: no way to USB has this name here.
        """
        super().__init__()
        if isinstance(transport, str):
            check_name(transport)
        self._path, self._chosen_transport = stations, transport
        self._raw_path = raw
        self._raw: RawRecording | None = None
        self._raw_problem = ""
        self._chosen = by_serial(serials)
        self._hub: Hub | None = None
        self._infos: dict[str, DeviceInfo] = {}

    @classmethod
    def probe(cls) -> Probe:
        """Whether scipy and a way to USB are here."""
        solver = probe_library("scipy", "scipy", "lighthouse")
        usable, missing = available_transports()
        if not solver.available or usable:
            return solver
        return missing[0].why

    def _connect(self) -> Hub:
        transport = self._chosen_transport
        if transport is None or isinstance(transport, str):
            if steamvr_runs():
                raise DeviceBusy("SteamVR has these devices: close it, or take --driver openvr")
            transport = choose_transport(transport)
        try:
            if self._raw_path is not None:
                transport = self._raw = RawRecording(transport, self._raw_path)
            self._hub = Hub(transport, self._path)
        except (StationFileError, OutputError) as error:
            self._end_raw()
            raise DriverUnavailable(str(error)) from error
        except BaseException:  # also Ctrl-C
            self._end_raw()
            raise
        return self._hub

    def events(self) -> Sequence[DeviceEvent]:
        """As of every stream; and once, that the capture ended early."""
        events = super().events()
        problem = "" if self._raw is None else self._raw.problem
        if problem == self._raw_problem:
            return events
        self._raw_problem = problem
        return (*events, DeviceEvent(EventKind.NOTICE, "", self._last_s, problem))

    def close(self) -> None:
        """Release the devices, and finish the capture."""
        super().close()
        self._end_raw()

    def _end_raw(self) -> None:
        raw, self._raw, self._raw_problem = self._raw, None, ""
        if raw is not None:
            raw.close()

    def _begin(self) -> None:
        super()._begin()
        self._infos.clear()

    def devices(self) -> Sequence[DeviceInfo]:
        """All devices seen since opening, and the base stations."""
        hub = self._hub
        if self._thread is None or hub is None:
            return []
        self._infos |= {about.model.serial: self._describe(about) for about in hub.about()}
        stations = [
            DeviceInfo(
                station_name(c), BASE_STATION, f"Lighthouse {c.generation}.0, channel {number + 1}"
                if c.generation == 2 else f"Lighthouse 1.0, mode {'ABC'[min(c.mode, 2)]}",
            )
            for number, c in sorted(hub.stations().items())
        ]  # fmt: skip
        return [*self._infos.values(), *stations]

    def _info(self, serial: str) -> DeviceInfo:
        return self._infos.get(serial, DeviceInfo(serial, "tracker"))

    def _describe(self, about: DeviceAbout) -> DeviceInfo:
        model, sight = about.model, about.sight
        return DeviceInfo(
            model.serial,
            KINDS.get(model.device_class, "tracker"),
            model.model,
            hint(model.serial, _said_role(about), self._chosen),
            about.firmware,
            about.battery,
            stations_in_view=0 if sight is None else sight.stations,
            sensors_hit=0 if sight is None else sight.sensors,
        )


def _said_role(about: DeviceAbout) -> TrackerRole | None:
    """A headset is worn on the head, a Knuckles says for which hand it is; others say nothing."""
    if about.model.device_class == "hmd":
        return TrackerRole.HEAD
    words = about.model.model.lower().split()
    if about.model.device_class == "controller" and "left" in words:
        return TrackerRole.LEFT_HAND
    if about.model.device_class == "controller" and "right" in words:
        return TrackerRole.RIGHT_HAND
    return None
