"""A session without a picture: what an OpenXR runtime knows about devices, and nothing drawn."""

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any

import numpy as np

from lobstr_hw.drivers.openxr import xdev
from lobstr_hw.drivers.openxr.actions import Actions
from lobstr_hw.drivers.openxr.bindings import HANDS
from lobstr_hw.drivers.openxr.locations import Location
from lobstr_hw.drivers.openxr.runtime_clock import EXTENSION as CLOCK
from lobstr_hw.drivers.openxr.runtime_clock import clock_of
from lobstr_hw.errors import DriverUnavailable
from lobstr_hw.trackers import TrackerRole

__all__ = ["HAND_SERIALS", "HEAD_SERIAL", "Device", "Happening", "Session"]

HEADLESS = "XR_MND_headless"
VIVE_TRACKERS = "XR_HTCX_vive_tracker_interaction"
NEEDED = (HEADLESS, CLOCK)
WANTED = (VIVE_TRACKERS, xdev.EXTENSION)

HEAD_SERIAL = "OPENXR-HEAD"
HAND_SERIALS = {
    TrackerRole.LEFT_HAND: "OPENXR-LEFT-HAND",
    TrackerRole.RIGHT_HAND: "OPENXR-RIGHT-HAND",
}
"""OpenXR tells no serials but those of trackers."""


class Happening(Enum):
    """What a session tells besides poses."""

    RECENTRED = auto()
    OVER = auto()


@dataclass(frozen=True, slots=True, eq=False)
class Device:
    """Something that can be located."""

    serial: str
    kind: str
    model: str
    role: TrackerRole | None
    space: Any


class Session:
    """Instance, session, spaces and actions of one runtime."""

    def __init__(self, xr: Any) -> None:
        """Begin; ready for use once the runtime says so.

        Raises:
            DriverUnavailable: the runtime lacks an extension that is needed.
            xr.XrException, ValueError: the runtime refuses.
        """
        self._xr = xr
        self._instance = self._session = None
        self._xdevs: xdev.XDevList | None = None
        self._running = self.awake = False
        try:
            self._create(_extensions(xr))
        except Exception:
            self.close()
            raise

    def _create(self, extensions: list[str]) -> None:
        xr = self._xr
        self._instance = xr.create_instance(
            xr.InstanceCreateInfo(
                enabled_extension_names=extensions,
                application_info=xr.ApplicationInfo("lobstr-hw", 1, "lobstr-hw", 1),
            )
        )
        system = xr.get_system(self._instance, xr.SystemGetInfo())
        name = xr.get_system_properties(self._instance, system).system_name
        self.system_name = name.decode(errors="replace")
        info = xr.SessionCreateInfo(system_id=system)
        self._session = xr.create_session(self._instance, info)
        self._with_vive = VIVE_TRACKERS in extensions
        self.actions = Actions(xr, self._instance, self._session, self._with_vive)
        if xdev.EXTENSION in extensions:
            self._xdevs = xdev.XDevList(xr, self._instance, self._session)
        self.now_s = clock_of(xr, self._instance)
        self._stage = self._floor_space()
        self._head = Device(
            HEAD_SERIAL, "headset", self.system_name, TrackerRole.HEAD, self._view()
        )
        self._generation = -1
        self._placed: list[Device] = []
        self._vive_serials: dict[TrackerRole, str] = {}
        self._read_vive()

    def happenings(self) -> Iterator[Happening]:
        """Take the runtime's messages, and go along with its session states."""
        xr = self._xr
        while True:
            try:
                message = xr.poll_event(self._instance)
            except xr.EventUnavailable:
                return
            kind, seen = xr.StructureType, message._type  # .type raises where it knows no name
            if seen == kind.EVENT_DATA_SESSION_STATE_CHANGED.value:
                changed = _read_as(xr.EventDataSessionStateChanged, message)
                yield from self._follow(changed.state)
            elif seen == kind.EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING.value:
                changed = _read_as(xr.EventDataReferenceSpaceChangePending, message)
                if changed.reference_space_type == self._floor_type:
                    yield Happening.RECENTRED
            elif seen == kind.EVENT_DATA_INSTANCE_LOSS_PENDING.value:
                yield Happening.OVER
            elif seen == kind.EVENT_DATA_VIVE_TRACKER_CONNECTED_HTCX.value:
                self._read_vive()

    def _follow(self, state: Any) -> Iterator[Happening]:
        states = self._xr.SessionState
        self.awake = state == states.FOCUSED
        if state == states.READY:
            self._xr.begin_session(self._session, self._xr.SessionBeginInfo())
            self._running = True
        elif state == states.STOPPING:
            self._xr.end_session(self._session)
            self._running = False
        elif state in (states.LOSS_PENDING, states.EXITING):
            yield Happening.OVER

    def devices(self) -> list[Device]:
        """Who is there. Without the focus nobody can tell, and it stays as it was."""
        if not self._running:
            return []
        if self.awake:
            self.actions.sync()
            places = [self._place(role) for role in self.actions.active()]
            self._placed = [device for device in places if device is not None]
        return [self._head, *self._placed, *self._by_xdev()]

    def locate(self, device: Device, time_s: float) -> Location:
        """Where a device is, or was, at a time of the runtime."""
        location, velocity = self._xr.locate_space_with_velocity(
            device.space, self._stage, round(time_s * 1e9)
        )
        p, q = location.pose.position, location.pose.orientation
        v = velocity.linear_velocity
        known = velocity._velocity_flags & self._xr.SpaceVelocityFlags.LINEAR_VALID_BIT.value
        return Location(
            location._location_flags,
            np.array([p.x, p.y, p.z]),
            np.array([q.x, q.y, q.z, q.w]),
            np.array([v.x, v.y, v.z]) if known else None,
        )

    def close(self) -> None:
        """End everything; twice is harmless; never raises."""
        if self._instance is None:
            return
        try:
            self._xr.destroy_instance(self._instance)  # and all that was made from it
        except (self._xr.XrException, ValueError):
            pass  # the runtime is gone already
        self._instance = None
        self._running = self.awake = False

    def _place(self, role: TrackerRole) -> Device | None:
        space = self.actions.spaces[role]
        if role in HANDS:
            return Device(HAND_SERIALS[role], "controller", self.system_name, role, space)
        serial = self._vive_serials.get(role)
        return Device(serial, "tracker", "Vive tracker", role, space) if serial else None

    def _by_xdev(self) -> list[Device]:
        """Monado's trackers, unless they are there under a role already."""
        if self._xdevs is None:
            return []
        if self._xdevs.generation() != self._generation:
            self._generation = self._xdevs.generation()
            self._loose = [
                Device(found.serial, "tracker", found.name, None, self._xdevs.space(found))
                for found in self._xdevs.trackers()
            ]
        return [d for d in self._loose if d.serial not in self._vive_serials.values()]

    def _read_vive(self) -> None:
        xr = self._xr
        if not self._with_vive:
            return
        roles = {path: role for role, path in self.actions.places.items()}
        self._vive_serials = {}
        for paths in xr.enumerate_vive_tracker_paths_htcx(self._instance):
            if paths.role_path == xr.NULL_PATH:  # no role was given to it
                continue
            role = roles.get(xr.path_to_string(self._instance, paths.role_path))
            if role is not None:
                name = xr.path_to_string(self._instance, paths.persistent_path)
                self._vive_serials[role] = _serial_in(name)

    def _floor_space(self) -> Any:
        kinds = self._xr.ReferenceSpaceType
        try:
            self._floor_type = kinds.STAGE
            return self._reference(kinds.STAGE)
        except self._xr.ReferenceSpaceUnsupportedError:
            self._floor_type = kinds.LOCAL  # its floor is found by the calibration
            return self._reference(kinds.LOCAL)

    def _view(self) -> Any:
        # OpenXR allows no action for /user/head
        return self._reference(self._xr.ReferenceSpaceType.VIEW)

    def _reference(self, kind: Any) -> Any:
        info = self._xr.ReferenceSpaceCreateInfo(reference_space_type=kind)
        return self._xr.create_reference_space(self._session, info)


def _extensions(xr: Any) -> list[str]:
    offered = {
        properties.extension_name.decode()
        for properties in xr.enumerate_instance_extension_properties()
    }
    missing = [name for name in NEEDED if name not in offered]
    if missing:
        raise DriverUnavailable(
            f"this OpenXR runtime cannot do without a picture: it lacks {' and '.join(missing)}. "
            "Use SteamVR's or Monado's runtime, or --driver openvr."
        )
    return [*NEEDED, *(name for name in WANTED if name in offered)]


def _read_as(struct: Any, message: Any) -> Any:
    return ctypes.cast(ctypes.byref(message), ctypes.POINTER(struct)).contents


def _serial_in(persistent_path: str) -> str:
    """``/devices/htc/vive_trackerLHR-1A2B`` -> ``LHR-1A2B``; any other path's last part."""
    return persistent_path.rsplit("/", 1)[-1].removeprefix("vive_tracker") or persistent_path
