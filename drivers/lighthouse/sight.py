"""What a device sees just now: which stations, and with how many of its sensors."""

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, Ints

__all__ = ["Sight"]

NOW = TICKS_PER_S // 4
"""Ticks: five turns of a Gen2 station, in which a sensor in its light is hit for sure."""
STATIONS = 16
NEVER = -(2**62)


class Sight:
    """Remembers when each sensor was hit last, and by each station."""

    def __init__(self, sensors: int) -> None:
        """Nothing was seen."""
        self._sensors: Ints = np.full(sensors, NEVER, dtype=np.int64)
        self._stations: Ints = np.full(STATIONS, NEVER, dtype=np.int64)
        self._newest = 0

    def add(self, angles: Angles, newest: int) -> None:
        """More hits, up to the device's time ``newest``."""
        self._newest = newest
        np.maximum.at(self._sensors, angles.sensor, angles.ticks)
        np.maximum.at(self._stations, angles.station, angles.ticks)

    @property
    def stations(self) -> int:
        """How many stations are in view."""
        return int(np.count_nonzero(self._stations > self._newest - NOW))

    @property
    def sensors(self) -> int:
        """How many sensors are hit."""
        return int(np.count_nonzero(self._sensors > self._newest - NOW))
