"""SteamVR as a tracker driver."""

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np

from lobstr_hw.drivers.chosen_roles import ROLE_OPTIONS, by_serial
from lobstr_hw.drivers.driver import (
    BASE_STATION,
    DeviceEvent,
    DeviceInfo,
    EventKind,
    Probe,
    TrackerDriver,
)
from lobstr_hw.drivers.openvr.buttons import button_name
from lobstr_hw.drivers.openvr.devices import DeviceReader
from lobstr_hw.drivers.openvr.init_errors import translated
from lobstr_hw.drivers.openvr.readings import NOWHERE, records, sample_of
from lobstr_hw.drivers.vendor import probe_library, require_library
from lobstr_hw.errors import DriverUnavailable
from lobstr_hw.poses import PartialPose
from lobstr_hw.trackers import TrackerSample

__all__ = ["OpenVRDriver"]

NO_PREDICTION_S = 0.0
"""SteamVR can look ahead; the network was trained on where devices are."""

EVENTS_PER_POLL = 256
"""A flood of events must not hold up a tick; the rest waits for the next."""

LIBRARY = ("openvr", "openvr", "openvr")
"""Module, package, extra."""

NO_RUNTIME = Probe(False, "SteamVR", "install Steam and SteamVR, start SteamVR once")


class OpenVRDriver(TrackerDriver):
    """Headset, controllers and trackers of a running SteamVR, in its standing universe.

    SteamVR stamps no pose, so a sample's time is the time of the poll that asked for it. The
    session is one of a background application: it never starts SteamVR. When SteamVR quits, all
    devices are gone, and the driver has to be opened again.
    """

    options: ClassVar = ROLE_OPTIONS
    """A serial per role, as in ``openvr:pelvis=LHR-1A2B3C4D``; goes before what SteamVR says."""

    def __init__(self, **serials: str) -> None:
        """Remember which serials stand for which roles; nothing is loaded yet."""
        self._chosen = by_serial(serials)
        self._openvr: Any = None
        self._system: Any = None
        self._forget()

    def _forget(self) -> None:
        self._connected: dict[int, str] = {}
        self._infos: dict[str, DeviceInfo] = {}
        self._held: dict[str, PartialPose] = {}
        self._pressed: set[tuple[str, str]] = set()
        self._events: list[DeviceEvent] = []
        self._stale = False
        self._last_s = -np.inf

    @classmethod
    def probe(cls) -> Probe:
        """Look for the package and for SteamVR; whether it runs only ``open`` can tell."""
        package = probe_library(*LIBRARY)
        if not package.available:
            return package
        try:
            return Probe(True) if require_library(*LIBRARY).isRuntimeInstalled() else NO_RUNTIME
        except DriverUnavailable as error:
            return Probe(False, str(error))

    def open(self) -> None:
        """Begin a session with a SteamVR that runs.

        Raises:
            DriverUnavailable: no package, no SteamVR, or it does not run.
            TrackerNotFound: SteamVR sees no headset.
            DeviceBusy: SteamVR is starting, stopping or updating.
        """
        self.close()
        openvr = require_library(*LIBRARY)
        self._poses = (openvr.TrackedDevicePose_t * openvr.k_unMaxTrackedDeviceCount)()
        self._records = records(self._poses)
        self._event = openvr.VREvent_t()
        try:
            openvr.initInternal2(openvr.VRApplication_Background, None)
        except (openvr.OpenVRError, KeyError) as error:
            raise translated(error) from error
        self._openvr = openvr
        try:
            self._system = openvr.VRSystem()
        except (openvr.OpenVRError, KeyError) as error:
            self.close()
            raise translated(error) from error
        self._reader = DeviceReader(openvr, self._system, self._chosen)
        self._ask_poses()
        self._meet_devices(-np.inf)

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """Where everything is now; a vanished device is told once."""
        if self._system is None or now_s <= self._last_s:
            return ()
        self._ask_poses()
        self._read_events(now_s)
        self._meet_devices(now_s)
        samples = list(self._samples(now_s))
        self._lose_devices(now_s)
        self._last_s = now_s
        return samples

    def devices(self) -> Sequence[DeviceInfo]:
        """All devices seen since opening; base stations give no samples."""
        if self._stale and self._system is not None:
            for index, serial in self._connected.items():
                self._infos[serial] = self._reader.info(index)
            self._stale = False
        return list(self._infos.values())

    def events(self) -> Sequence[DeviceEvent]:
        """What happened up to the last poll."""
        happened, self._events = self._events, []
        return sorted(happened, key=lambda event: event.time_s)

    def close(self) -> None:
        """End the session; SteamVR goes on."""
        if self._openvr is not None:
            self._openvr.shutdown()
        self._openvr = self._system = None
        self._forget()

    def _ask_poses(self) -> None:
        standing = self._openvr.TrackingUniverseStanding
        self._system.getDeviceToAbsoluteTrackingPose(standing, NO_PREDICTION_S, self._poses)

    def _samples(self, time_s: float) -> Iterator[TrackerSample]:
        for index, serial in self._connected.items():
            if self._infos[serial].kind == BASE_STATION:
                continue
            held = self._held.get(serial, NOWHERE)
            sample = sample_of(serial, self._records[index], held, time_s)
            if sample.tracked:
                self._held[serial] = sample.T_world_tracker
            yield sample

    def _meet_devices(self, time_s: float) -> None:
        for index in np.flatnonzero(self._records["connected"]).tolist():
            if index in self._connected:
                continue
            info = self._reader.info(index)
            if not info.serial or not info.kind:  # just waking up; or nothing that moves
                continue
            if info.serial in self._infos:
                self._tell(EventKind.BACK, info.serial, time_s)
            self._connected[index], self._infos[info.serial] = info.serial, info

    def _lose_devices(self, time_s: float) -> None:
        gone = [i for i in self._connected if not self._records[i]["connected"]]
        for serial in [self._connected.pop(index) for index in gone]:
            for name in sorted(n for s, n in self._pressed if s == serial):
                self._press(EventKind.BUTTON_UP, serial, name, time_s)
            self._tell(EventKind.GONE, serial, time_s)

    def _read_events(self, now_s: float) -> None:
        openvr = self._openvr
        for _ in range(EVENTS_PER_POLL):
            if not self._system.pollNextEvent(self._event):
                return
            time_s = min(max(now_s - self._event.eventAgeSeconds, self._last_s), now_s)
            match self._event.eventType:
                case openvr.VREvent_Quit:
                    self._quit()
                    return
                case openvr.VREvent_ButtonPress:
                    self._button(EventKind.BUTTON_DOWN, time_s)
                case openvr.VREvent_ButtonUnpress:
                    self._button(EventKind.BUTTON_UP, time_s)
                case (
                    openvr.VREvent_StandingZeroPoseReset
                    | openvr.VREvent_ChaperoneUniverseHasChanged
                ):
                    self._recentred(time_s)
                case _:  # a role, a setting, a battery, the headset put on: read when asked for
                    self._stale = True

    def _quit(self) -> None:
        """SteamVR kills who does not leave; to the outside it is as if all plugs were pulled."""
        self._system.acknowledgeQuit_Exiting()
        self._openvr.shutdown()
        self._openvr = self._system = None
        self._records["connected"] = False

    def _button(self, kind: EventKind, time_s: float) -> None:
        index = self._event.trackedDeviceIndex
        serial = self._connected.get(index)
        number = self._event.data.controller.button
        name = button_name(number, self._reader.controller_type(index)) if serial else None
        if serial and name:
            self._press(kind, serial, name, time_s)

    def _press(self, kind: EventKind, serial: str, name: str, time_s: float) -> None:
        """Tell of a change; SteamVR may repeat itself, or let go of what was held before us."""
        down = kind is EventKind.BUTTON_DOWN
        if down == ((serial, name) in self._pressed):
            return
        (self._pressed.add if down else self._pressed.discard)((serial, name))
        self._tell(kind, serial, time_s, name)

    def _recentred(self, time_s: float) -> None:
        """One shift of the room raises several events."""
        if not any(event.kind is EventKind.RECENTRED for event in self._events):
            self._tell(EventKind.RECENTRED, "", time_s)

    def _tell(self, kind: EventKind, serial: str, time_s: float, name: str = "") -> None:
        self._events.append(DeviceEvent(kind, serial, time_s, name))
