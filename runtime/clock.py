"""The one clock. No other module reads time (docs/conventions.md)."""

import time
from typing import Protocol

__all__ = ["Clock", "HostClock"]


class Clock(Protocol):
    """Monotonic seconds, and waiting for them to pass."""

    def now_s(self) -> float:
        """Seconds since some fixed moment; never steps back."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait at least this long; nothing for zero or less."""
        ...

    def unix_s(self) -> float:
        """UNIX time now, for logs only: it may step."""
        ...


class HostClock:
    """The machine's clock, counted from when this object was made.

    ``perf_counter_ns``, because ``time.monotonic`` steps by 15.6 ms on Windows. From zero, because
    a replay and a session with devices then share one scale, and logs hold no negative times.
    """

    def __init__(self) -> None:
        """Start at zero."""
        self._zero_ns = time.perf_counter_ns()

    def now_s(self) -> float:
        """Seconds since the start."""
        return (time.perf_counter_ns() - self._zero_ns) * 1e-9

    def sleep(self, seconds: float) -> None:
        """Wait; the operating system may oversleep by a millisecond or so."""
        if seconds > 0.0:
            time.sleep(seconds)

    def unix_s(self) -> float:
        """UNIX time now."""
        return time.time()
