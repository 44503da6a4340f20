"""What time it is for an OpenXR runtime.

OpenXR gives poses of the time one asks for, and has no call for "now": it only converts the host's
clock. So this clock is read here, as a device's clock is read elsewhere, and never given to anybody
as host time.
"""

import ctypes
import sys
import time
from collections.abc import Callable
from typing import Any

__all__ = ["EXTENSION", "clock_of"]

if sys.platform == "win32":
    EXTENSION = "XR_KHR_win32_convert_performance_counter_time"
else:
    EXTENSION = "XR_KHR_convert_timespec_time"


class Timespec(ctypes.Structure):
    """``struct timespec`` of 64-bit systems."""

    _fields_ = (("seconds", ctypes.c_longlong), ("nanoseconds", ctypes.c_long))


def clock_of(xr: Any, instance: Any) -> Callable[[], float]:
    """A function that gives the runtime's time in seconds; its zero is the runtime's own."""
    name, host = (
        ("xrConvertWin32PerformanceCounterToTimeKHR", ctypes.c_int64)
        if sys.platform == "win32"
        else ("xrConvertTimespecTimeToTimeKHR", Timespec)
    )
    prototype = ctypes.CFUNCTYPE(
        ctypes.c_int32, ctypes.c_void_p, ctypes.POINTER(host), ctypes.POINTER(ctypes.c_int64)
    )
    convert = ctypes.cast(xr.get_instance_proc_addr(instance, name), prototype)
    handle = ctypes.cast(instance, ctypes.c_void_p)
    now = ctypes.c_int64()

    def now_s() -> float:
        convert(handle, ctypes.byref(_host_time()), ctypes.byref(now))
        return now.value * 1e-9

    return now_s


def _host_time() -> Any:
    if sys.platform == "win32":
        counter = ctypes.c_int64()
        ctypes.windll.kernel32.QueryPerformanceCounter(ctypes.byref(counter))
        return counter
    return Timespec(*divmod(time.clock_gettime_ns(time.CLOCK_MONOTONIC), 1_000_000_000))
