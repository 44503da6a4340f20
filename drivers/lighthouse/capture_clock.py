"""From a recorded device's clock to the time of its recording."""

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Ints
from lobstr_hw.rotations import Array

__all__ = ["CaptureClock"]

SPAN_TICKS = TICKS_PER_S // 2
"""In each span of so long one packet came through without waiting."""
JUMP_S = 0.5
"""The clocks part by more from one packet to the next: one was set, or a time is broken."""
MOST_DRIFT = 2e-4
"""Between two crystals, with room to spare."""


class CaptureClock:
    """Where a device's ticks lie on the clock of the host that recorded them.

    Packets come late by a delay that is never negative: the line under them is the truth but for
    the shortest delay. Over a whole recording the drift follows, too, which a live clock
    (drivers/device_clock.py) cannot know.
    """

    def __init__(self) -> None:
        """Nothing was heard."""
        self._parts: list[dict[int, tuple[int, float]]] = []
        self._offset_s = 0.0

    def observe(self, ticks: int, arrived_s: float) -> None:
        """One packet: the device's time beside the recording's."""
        offset_s = arrived_s - ticks / TICKS_PER_S
        if not self._parts or abs(offset_s - self._offset_s) > JUMP_S:
            self._parts.append({})
        self._offset_s = offset_s
        part = self._parts[-1]
        span = ticks // SPAN_TICKS
        if span not in part or offset_s < part[span][1]:
            part[span] = (ticks, offset_s)

    def seconds(self, ticks: Ints) -> Array:
        """Times (n,) in the recording of ticks (n,) of the device, within and around it.

        Raises:
            ValueError: nothing was observed.
        """
        if not self._parts:
            raise ValueError("no packet was observed: there is no clock to map to")
        # a packet's older samples lie before what was observed: the border is between the parts
        first = np.array([next(iter(part.values()))[0] for part in self._parts])
        last = np.array([max(ticks for ticks, _ in part.values()) for part in self._parts])
        at = np.searchsorted(np.maximum.accumulate((first[1:] + last[:-1]) // 2), ticks)
        middle, offset, drift = np.array([_line(part) for part in self._parts])[at].T
        passed = (ticks - middle) / TICKS_PER_S
        return np.asarray(ticks / TICKS_PER_S + offset + drift * passed)


def _line(part: dict[int, tuple[int, float]]) -> tuple[float, float, float]:
    """The line under a stretch: a moment, the offset there, the drift."""
    ticks = np.array([t for t, _ in part.values()], dtype=np.int64)
    offset = np.array([o for _, o in part.values()])
    middle = int(ticks.mean())
    passed = (ticks - middle) / TICKS_PER_S
    drift = float(np.polyfit(passed, offset, 1)[0]) if len(ticks) > 4 else 0.0
    drift = float(np.clip(drift, -MOST_DRIFT, MOST_DRIFT))
    return float(middle), float((offset - drift * passed).min()), drift
