"""Which generation's light a device should tell: it tells that of one only.

By cable a device in the light of Gen2 stations says so (report 27). By radio it says nothing that
makes sense, so one mode after the other is tried until light is understood. Devices that know Gen1
only are left alone. Time is the device's own.
"""

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S

__all__ = ["LightMode"]

ENOUGH = 20
"""Hits that prove a mode right: noise makes a few."""
FIRST_TRY, LONGEST_TRY = 1 * TICKS_PER_S, 8 * TICKS_PER_S
LONGEST_STEP = TICKS_PER_S // 10
"""A longer one is a clock that began anew, as some do when the mode changes, or lost reports."""


class LightMode:
    """Looks at what comes, and says when to change the mode.

    Attributes:
        gen2: the mode that the device is in.
    """

    def __init__(self, gen2: bool, has_choice: bool, tells: bool) -> None:
        """Begin.

        Args:
            gen2: the mode it is in.
            has_choice: the device knows both.
            tells: it says by itself when it sees Gen2 in the mode for Gen1.
        """
        self.gen2 = gen2
        self._has_choice, self._tells = has_choice, tells
        self._hits = self._tried = 0
        self._newest: int | None = None
        # a cable's word for it is certain and comes at once; the other way there is none
        self._patience = LONGEST_TRY if tells else FIRST_TRY

    def switch(self, now: int, hits: int, sees_gen2: bool) -> bool:
        """Whether the mode changes now; it is then the other one.

        Args:
            now: device ticks.
            hits: decoded since the last call.
            sees_gen2: the device said so.
        """
        step = 0 if self._newest is None else now - self._newest
        self._tried += min(max(step, 0), LONGEST_STEP)
        self._newest = now
        self._hits += hits
        if not self._has_choice or self._hits >= ENOUGH:
            return False
        told = sees_gen2 and not self.gen2
        tried = self._tried > self._patience and (self.gen2 or not self._tells)
        if told or tried:
            self.gen2, self._tried, self._hits = not self.gen2, 0, 0
            self._patience = min(2 * self._patience, LONGEST_TRY)
        return told or tried
