"""Input reports of an open device, fetched by one thread for each of its interfaces."""

from collections import deque
from collections.abc import Callable, Mapping
from threading import Condition, Event, Thread
from time import perf_counter

from lobstr_hw.drivers.lighthouse.transport import LinkLost, RawReport

__all__ = ["QUEUE_LENGTH", "ReportQueue"]

QUEUE_LENGTH = 4096
"""Reports: two seconds of the busiest headset. The oldest are dropped beyond that."""
JOIN_S = 5.0
Fetch = Callable[[], bytes]
"""Waits a moment for one report; empty: none came. LinkLost or OSError: the device is gone."""


class ReportQueue:
    """Fills as long as it is open; what came before the device was lost can still be read."""

    def __init__(self, ends: Mapping[int, Fetch]) -> None:
        """Start to fetch; ``ends``: how, by interface."""
        self._reports: deque[RawReport] = deque()
        self._news, self._stop = Condition(), Event()
        self._lost = ""
        self.dropped = 0
        self._threads = [
            Thread(target=self._run, args=end, name="lobstr-usb", daemon=True)
            for end in ends.items()
        ]
        for thread in self._threads:
            thread.start()

    @property
    def lost(self) -> str:
        """Why no more reports come, or empty."""
        return self._lost

    def read(self, timeout_s: float) -> RawReport | None:
        """As ``OpenDevice.read``."""
        with self._news:
            if not self._reports and not self._lost and timeout_s > 0.0:
                self._news.wait_for(lambda: self._reports or self._lost, timeout_s)
            if self._reports:
                return self._reports.popleft()
            if self._lost:
                raise LinkLost(self._lost)
            return None

    def close(self) -> None:
        """End the threads; a device must not be closed while one of them reads it."""
        self._stop.set()
        for thread in self._threads:
            thread.join(JOIN_S)
        self._end("closed")

    def _run(self, interface: int, fetch: Fetch) -> None:
        why = "its reading ended"  # by a bug: the caller sees a lost device, not silence
        try:
            while not self._stop.is_set():
                data = fetch()
                if data:
                    self._put(RawReport(interface, data, perf_counter()))
            why = "closed"
        except (LinkLost, OSError) as error:
            why = str(error) or "unplugged"
        finally:
            self._end(why)

    def _put(self, report: RawReport) -> None:
        with self._news:
            if len(self._reports) >= QUEUE_LENGTH:
                self._reports.popleft()
                self.dropped += 1
            self._reports.append(report)
            self._news.notify()

    def _end(self, why: str) -> None:
        with self._news:
            self._lost = self._lost or why
            self._news.notify_all()
