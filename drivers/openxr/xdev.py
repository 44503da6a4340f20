"""XR_MNDX_xdev_space: Monado's list of every device it tracks, whatever its role.

The package pyopenxr does not know this extension, so its calls are declared here, from Monado's
header ``XR_MNDX_xdev_space.h``.
"""

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

__all__ = ["EXTENSION", "XDev", "XDevList"]

EXTENSION = "XR_MNDX_xdev_space"

LIST_INFO, GET_INFO, PROPERTIES, SPACE_INFO = 1000444002, 1000444003, 1000444004, 1000444005
TEXT_BYTES = 256
LIMIT = 64


class _Header(ctypes.Structure):
    _fields_ = (("type", ctypes.c_int32), ("next", ctypes.c_void_p))


class _GetInfo(ctypes.Structure):
    _fields_ = (("header", _Header), ("id", ctypes.c_uint64))


class _Properties(ctypes.Structure):
    _fields_ = (
        ("header", _Header),
        ("name", ctypes.c_char * TEXT_BYTES),
        ("serial", ctypes.c_char * TEXT_BYTES),
        ("can_create_space", ctypes.c_uint32),
    )


class _SpaceInfo(ctypes.Structure):
    _fields_ = (
        ("header", _Header),
        ("list", ctypes.c_void_p),
        ("id", ctypes.c_uint64),
        ("orientation_xyzw", ctypes.c_float * 4),
        ("position", ctypes.c_float * 3),
    )


_ARGUMENTS = {
    "xrCreateXDevListMNDX": (ctypes.c_void_p,) * 3,
    "xrGetXDevListGenerationNumberMNDX": (ctypes.c_void_p,) * 2,
    "xrEnumerateXDevsMNDX": (ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p, ctypes.c_void_p),
    "xrGetXDevPropertiesMNDX": (ctypes.c_void_p,) * 3,
    "xrCreateXDevSpaceMNDX": (ctypes.c_void_p,) * 3,
}


@dataclass(frozen=True, slots=True)
class XDev:
    """One device that can be located."""

    id: int
    name: str
    serial: str


class XDevList:
    """The devices of a session; it goes with the session."""

    def __init__(self, xr: Any, instance: Any, session: Any) -> None:
        """Make the list.

        Raises:
            xr.XrException: the runtime refuses.
        """
        self._xr, self._instance, self._session = xr, instance, session
        self._handle = ctypes.c_void_p()
        self._functions = {
            name: ctypes.cast(
                xr.get_instance_proc_addr(instance, name),
                ctypes.CFUNCTYPE(ctypes.c_int32, *arguments),
            )
            for name, arguments in _ARGUMENTS.items()
        }
        info = _Header(LIST_INFO, None)
        self._call("xrCreateXDevListMNDX", session, ctypes.byref(info), ctypes.byref(self._handle))

    def generation(self) -> int:
        """Another number: the list has changed."""
        number = ctypes.c_uint64()
        self._call("xrGetXDevListGenerationNumberMNDX", self._handle, ctypes.byref(number))
        return number.value

    def trackers(self) -> Iterator[XDev]:
        """Those that are trackers by their name and can be located.

        Headset and controllers are on the list too, under names without a system.
        """
        ids, count = (ctypes.c_uint64 * LIMIT)(), ctypes.c_uint32()
        self._call("xrEnumerateXDevsMNDX", self._handle, LIMIT, ctypes.byref(count), ids)
        for number in ids[: count.value]:
            found = self._properties(number)
            name, serial = (
                found.name.decode(errors="replace"),
                found.serial.decode(errors="replace"),
            )
            if found.can_create_space and _is_body_tracker(name):
                yield XDev(number, name, serial or name)

    def space(self, device: XDev) -> Any:
        """A space that moves with a device."""
        identity = (ctypes.c_float * 4)(0.0, 0.0, 0.0, 1.0)
        info = _SpaceInfo(_Header(SPACE_INFO, None), self._handle, device.id, identity)
        space = self._xr.Space()
        space.instance = self._instance
        self._call("xrCreateXDevSpaceMNDX", self._session, ctypes.byref(info), ctypes.byref(space))
        return space

    def _properties(self, number: int) -> _Properties:
        info, found = _GetInfo(_Header(GET_INFO, None), number), _Properties()
        found.header.type = PROPERTIES
        self._call("xrGetXDevPropertiesMNDX", self._handle, ctypes.byref(info), ctypes.byref(found))
        return found

    def _call(self, name: str, *arguments: Any) -> None:
        result = self._xr.check_result(self._xr.Result(self._functions[name](*arguments)))
        if result.is_exception():
            raise result


def _is_body_tracker(name: str) -> bool:
    words = name.lower()
    return "tracker" in words and not any(part in words for part in ("hand t", "face", "eye"))
