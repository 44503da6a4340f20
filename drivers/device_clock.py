"""From a device's clock to the host's."""

__all__ = ["DeviceClock"]

WINDOW_S = 5.0
"""Two crystals drift apart by 0.1 ms a second at most: by half a millisecond in this time."""
RESTART_S = 1.0
"""A device whose clock steps back by more has been switched off and on."""


class DeviceClock:
    """Maps device time to host time by the packets that came through fastest.

    A packet arrives late by a delay that varies and is never negative. The least difference of
    arrival and device time over the last seconds is therefore the offset of the two clocks plus the
    shortest delay, and a late packet changes no sample's time.
    """

    def __init__(self) -> None:
        """Nothing is known yet."""
        self._forget()

    def _forget(self) -> None:
        self._newest_s = self._window_end_s = -float("inf")
        self._previous = self._least = float("inf")

    def observe(self, device_s: float, arrived_s: float) -> None:
        """Take note of one packet, host time of its arrival beside the device's own time."""
        if device_s < self._newest_s - RESTART_S:
            self._forget()
        self._newest_s = max(self._newest_s, device_s)
        if device_s > self._window_end_s:
            self._window_end_s = device_s + WINDOW_S
            self._previous, self._least = self._least, float("inf")
        self._least = min(self._least, arrived_s - device_s)

    def host_s(self, device_s: float) -> float:
        """Host time of a device time; something must have been observed."""
        return device_s + min(self._previous, self._least)
