"""An OpenXR runtime as a tracker driver."""

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from typing import ClassVar

import numpy as np

from lobstr_hw.drivers.chosen_roles import ROLE_OPTIONS, by_serial, hint
from lobstr_hw.drivers.device_clock import DeviceClock
from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind, Probe, TrackerDriver
from lobstr_hw.drivers.openxr.active_runtime import active_runtime
from lobstr_hw.drivers.openxr.init_errors import translated
from lobstr_hw.drivers.openxr.locations import judge
from lobstr_hw.drivers.openxr.session import HAND_SERIALS, Device, Happening, Session
from lobstr_hw.drivers.vendor import probe_library, require_library
from lobstr_hw.poses import PartialPose
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

__all__ = ["OpenXRDriver"]

LIBRARY = ("xr", "pyopenxr", "openxr")
"""Module, package, extra."""

NO_RUNTIME = Probe(
    False,
    "an active OpenXR runtime",
    "in SteamVR: Settings, OpenXR, set as active runtime; or start Monado",
)

START_S = 2.0
"""A runtime needs some frames before it hands out the focus, and hands and trackers with it."""
START_STEP_S = 0.01

NOWHERE = PartialPose(np.eye(3), None)
"""The pose of a device before its first known one."""


class OpenXRDriver(TrackerDriver):
    """Headset, hands and trackers of the active OpenXR runtime, over its floor.

    The session is a headless one: nothing is drawn, and other applications go on. A runtime gives
    the poses of the very time that is asked for, so samples have the time of the poll.
    """

    options: ClassVar = ROLE_OPTIONS
    """A serial per role, as in ``openxr:pelvis=LHR-1A2B3C4D``; goes before the runtime's roles."""

    def __init__(self, **serials: str) -> None:
        """Remember which serials stand for which roles; nothing is loaded yet."""
        self._chosen = by_serial(serials)
        self._session: Session | None = None
        self._forget()

    def _forget(self) -> None:
        self._clock = DeviceClock()
        self._there: dict[str, Device] = {}
        self._lost: set[str] = set()
        self._infos: dict[str, DeviceInfo] = {}
        self._held: dict[str, PartialPose] = {}
        self._events: list[DeviceEvent] = []
        self._last_s = -math.inf

    @classmethod
    def probe(cls) -> Probe:
        """Look for the package and for an active runtime; whether it runs ``open`` can tell."""
        package = probe_library(*LIBRARY)
        return NO_RUNTIME if package.available and active_runtime() is None else package

    def open(self) -> None:
        """Begin a session.

        Raises:
            DriverUnavailable: no package, no active runtime, or one that needs a picture.
            TrackerNotFound: the runtime has no headset.
            DeviceBusy: the runtime takes no further session.
        """
        self.close()
        xr = require_library(*LIBRARY)
        self._vendor_errors = (xr.XrException, ValueError)  # ValueError: a code it does not know
        try:
            self._session = Session(xr)
            self._wait_for_focus(self._session)
            self._infos = {d.serial: self._info(d) for d in self._listed()}
        except self._vendor_errors as error:
            self.close()
            raise translated(error) from error

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """Where everything is at now_s; a vanished device is told once."""
        session = self._session
        if session is None or now_s <= self._last_s:
            return ()
        # a tick runs at its nominal time or later: the least lateness is that of none
        self._clock.observe(now_s, session.now_s())
        try:
            self._take_in(session, now_s)
            samples = list(self._samples(session, now_s))
        except self._vendor_errors:  # the runtime died under us
            self._end()
            samples = []
        if self._session is None:
            samples = list(self._lose(list(self._there), now_s))
        self._last_s = now_s
        return samples

    def devices(self) -> Sequence[DeviceInfo]:
        """All devices seen since opening."""
        return list(self._infos.values())

    def events(self) -> Sequence[DeviceEvent]:
        """What happened up to the last poll."""
        happened, self._events = self._events, []
        return sorted(happened, key=lambda event: event.time_s)

    def close(self) -> None:
        """End the session; the runtime goes on."""
        self._end()
        self._forget()

    def _end(self) -> None:
        if self._session is not None:
            self._session.close()
        self._session = None

    def _listed(self) -> Sequence[Device]:
        return () if self._session is None else self._session.devices()

    def _wait_for_focus(self, session: Session) -> None:
        """Devices can be listed from the start; a headset that is not worn may never get it."""
        for _ in range(round(START_S / START_STEP_S)):
            self._take_in(session, -math.inf)
            if session.awake or self._session is None:
                return
            time.sleep(START_STEP_S)

    def _take_in(self, session: Session, time_s: float) -> None:
        for happening in session.happenings():
            if happening is Happening.RECENTRED:
                self._tell(EventKind.RECENTRED, "", time_s)
            elif happening is Happening.OVER:
                self._end()
                return

    def _samples(self, session: Session, time_s: float) -> Iterator[TrackerSample]:
        if self._session is None:
            return
        listed = {device.serial: device for device in session.devices()}
        yield from self._lose([serial for serial in self._there if serial not in listed], time_s)
        for serial, device in listed.items():
            if serial in self._lost:
                self._lost.remove(serial)
                self._tell(EventKind.BACK, serial, time_s)
            self._infos[serial] = self._info(device)
            yield self._sample(session, device, time_s)
        self._there = listed
        self._press(session, time_s)

    def _sample(self, session: Session, device: Device, time_s: float) -> TrackerSample:
        location = session.locate(device, self._clock.host_s(time_s))
        state, pose = judge(location, session.awake)
        tracked = state is TrackingState.OK
        if pose is None:
            pose = self._held.get(device.serial, NOWHERE)
        elif tracked:
            self._held[device.serial] = pose
        velocity = location.velocity if tracked else None
        return TrackerSample(device.serial, pose, time_s, tracked, state, velocity)

    def _lose(self, serials: Iterable[str], time_s: float) -> Iterator[TrackerSample]:
        for serial in serials:
            self._there.pop(serial)
            self._lost.add(serial)
            self._tell(EventKind.GONE, serial, time_s)
            pose = self._held.get(serial, NOWHERE)
            yield TrackerSample(serial, pose, time_s, False, TrackingState.GONE)

    def _press(self, session: Session, now_s: float) -> None:
        ahead_s = self._clock.host_s(now_s) - now_s
        for press in session.actions.presses():
            kind = EventKind.BUTTON_DOWN if press.down else EventKind.BUTTON_UP
            time_s = min(max(press.changed_s - ahead_s, self._last_s), now_s)
            self._tell(kind, HAND_SERIALS[press.role], time_s, press.name)

    def _info(self, device: Device) -> DeviceInfo:
        role: TrackerRole | None = hint(device.serial, device.role, self._chosen)
        return DeviceInfo(device.serial, device.kind, device.model, role)

    def _tell(self, kind: EventKind, serial: str, time_s: float, name: str = "") -> None:
        self._events.append(DeviceEvent(kind, serial, time_s, name))
