"""Seconds between the word and the measuring, for those who want time to get ready."""

import math

from lobstr_hw.runtime.announcer import Spoken

__all__ = ["Countdown"]

SPOKEN_S = 3
"""Only the last seconds are spoken: a voice needs most of a second for a number."""


class Countdown:
    """Counts down from a time on; time is told, not read."""

    def __init__(self, length_s: float, begun_s: float) -> None:
        """Begin.

        Args:
            length_s: of it; none at 0.
            begun_s: the time now.
        """
        self._ends_s = begun_s + length_s
        self._second: float = math.inf

    def left_s(self, now_s: float) -> float | None:
        """Until it is over; None once it is."""
        left_s = self._ends_s - now_s
        return left_s if left_s > 0.0 else None

    def skip(self) -> None:
        """End it now."""
        self._ends_s = -math.inf

    def words(self, now_s: float) -> list[Spoken]:
        """The second that has just begun, if it is one of the last."""
        left_s = self.left_s(now_s)
        if left_s is None or math.ceil(left_s) >= self._second:
            return []
        second = math.ceil(left_s)
        self._second = second
        return [Spoken(str(second))] if second <= SPOKEN_S else []
