"""A device's 48 MHz clock, unwrapped: it wraps every 89 s, some light times every 0.35 s."""

__all__ = ["Ticks"]

LATE = 1 << 24
"""An IMU sample may come this much after a newer one (0.35 s); further back the clock was set."""


class Ticks:
    """Extends a device's 32 and 24 bit times to 64 bits, by the IMU samples it sends all the time.

    The first time of all keeps its own value, so that ``ticks % 2**32`` is what the device said. A
    device that restarts its clock (some do when their light mode is switched) makes a gap, not a
    step back.
    """

    def __init__(self) -> None:
        """Nothing was heard."""
        self.newest: int | None = None

    def imu(self, low: int) -> int:
        """The full time of an IMU sample, from its 32 bits."""
        if self.newest is None:
            self.newest = low
        full = self.newest - LATE + ((low - self.newest + LATE) & 0xFFFFFFFF)
        self.newest = max(self.newest, full)
        return full

    def light(self, low: int, bits: int) -> int | None:
        """The full time of light: nearest to the newest IMU sample.

        Args:
            low: the bits that were sent.
            bits: how many, 24 or 32.

        Returns:
            None before the first IMU sample: nobody knows the bits that are missing.
        """
        if self.newest is None:
            return None
        half = 1 << (bits - 1)
        return self.newest + ((low - self.newest + half) & ((1 << bits) - 1)) - half
