"""A device's 48 MHz clock, unwrapped: it wraps every 89 s, some light times every 0.35 s."""

__all__ = ["Ticks"]


class Ticks:
    """Extends a device's 32 and 24 bit times to 64 bits, by the IMU samples it sends all the time.

    The first time of all keeps its own value, so that ``ticks % 2**32`` is what the device said.
    """

    def __init__(self) -> None:
        """Nothing was heard."""
        self.newest: int | None = None

    def imu(self, low: int) -> int:
        """The full time of an IMU sample, from its 32 bits: within 2**31 of the sample before."""
        self.newest = full = low if self.newest is None else _near(self.newest, low, 32)
        return full

    def light(self, low: int, bits: int) -> int | None:
        """The full time of light: nearest to the newest IMU sample.

        Args:
            low: the bits that were sent.
            bits: how many, 24 or 32.

        Returns:
            None before the first IMU sample, if 24 bits are all there is.
        """
        if self.newest is None:
            return self.imu(low) if bits == 32 else None
        return _near(self.newest, low, bits)


def _near(time: int, low: int, bits: int) -> int:
    """The time nearest to another whose lowest bits are ``low``."""
    half = 1 << (bits - 1)
    return time + ((low - time + half) & ((1 << bits) - 1)) - half
