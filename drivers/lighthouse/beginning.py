"""A device's first moments by cable: its light waits until its IMU samples run.

Samples and light come by different interfaces, which may overtake each other, and the first
reports can be left over from when somebody else read the device: seconds old, with times of a clock
that has gone on since or began anew. What comes of the light must not depend on which was first.
"""

from collections import deque

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S
from lobstr_hw.drivers.lighthouse.reports import PulseReport, SweepReport

__all__ = ["Beginning", "LightReport"]

LightReport = PulseReport | SweepReport

STEADY = TICKS_PER_S // 20
"""Ticks (50 ms) for which samples run without a gap until the light is believed."""
KEPT = {24: TICKS_PER_S // 20, 32: TICKS_PER_S}
"""Light of so long before the first of them (50 ms, 1 s) is kept, by the bits of its time."""
GAP = TICKS_PER_S // 50
"""Between two samples (20 ms; real ones come every 4 ms or sooner): the former was left over."""
DOUBTFUL = TICKS_PER_S // 5
"""Left-over light whose time has 24 bits seems to be of within 0.18 s of now: it is left out."""
MOST_HELD = 128
"""Reports, the newest; a device sends at most one in a millisecond."""


class Beginning:
    """From the first report until samples run.

    Attributes:
        over: they do: nothing needs to be held any more.
    """

    def __init__(self) -> None:
        """Nothing was heard."""
        self.over = False
        self._first: int | None = None
        self._last = 0
        self._left_over = False
        self._held: deque[LightReport] = deque(maxlen=MOST_HELD)

    def sample(self, ticks: int) -> None:
        """An IMU sample came."""
        if self.over:
            return
        if self._first is None:
            self._first = ticks
        elif ticks - self._last > GAP:
            self._first, self._left_over = ticks, True
        self._last = max(self._last, ticks)
        self.over = self._last - self._first >= STEADY

    def hold(self, light: LightReport) -> None:
        """Light came before it was over."""
        self._held.append(light)

    def release(self) -> list[LightReport]:
        """What was held, oldest first."""
        held = list(self._held)
        self._held.clear()
        return held

    def is_true(self, ticks: int, bits: int) -> bool:
        """Whether light of this time, sent with so many bits, is no left-over."""
        if self._first is None:
            return True
        doubtful = self._left_over and bits < 32
        return ticks >= self._first + (DOUBTFUL if doubtful else -KEPT[bits])
