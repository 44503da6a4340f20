"""Durations counted in bins: a session of days takes no more memory than one of minutes."""

import math
from array import array

__all__ = ["Durations"]

RESOLUTION = 1.01
"""Bins are one per cent wide."""
SMALLEST_MS = 1e-3
BINS = 2000
"""From a microsecond to seven minutes."""


class Durations:
    """Percentiles of many durations to one per cent; the largest exactly."""

    def __init__(self) -> None:
        """None yet."""
        self.count = 0
        self.max_ms = 0.0
        self._bins = array("q", bytes(8 * BINS))

    def add(self, duration_ms: float) -> None:
        """One more."""
        self.count += 1
        self.max_ms = max(self.max_ms, duration_ms)
        ratio = max(duration_ms, SMALLEST_MS) / SMALLEST_MS
        self._bins[min(int(math.log(ratio, RESOLUTION)), BINS - 1)] += 1

    def percentile_ms(self, share: float) -> float | None:
        """The duration below which this share lies (middle of its bin); None without any."""
        wanted = share * self.count
        below = 0
        for i, n in enumerate(self._bins):
            below += n
            if n and below >= wanted:
                return min(SMALLEST_MS * math.pow(RESOLUTION, i + 0.5), self.max_ms)
        return None

    def summary_ms(self) -> dict[str, float | None]:
        """p50, p99 and max; None without any."""
        found = {"p50": self.percentile_ms(0.5), "p99": self.percentile_ms(0.99)}
        found["max"] = self.max_ms if self.count else None
        return {name: None if ms is None else round(ms, 4) for name, ms in found.items()}
