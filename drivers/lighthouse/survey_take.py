"""What one device saw while it was carried about, kept for finding out where the stations stand.

Kept are quarters of a second in which the device moves and sees light, and the first second after
it came to rest. What lies between is left out, the device's time being moved together: else hours
on a table would drown the half minute that tells something.
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, DeviceModel, ImuSamples
from lobstr_hw.drivers.lighthouse.decoding import Decoded
from lobstr_hw.drivers.lighthouse.light import join_angles
from lobstr_hw.drivers.lighthouse.station_views import Take

__all__ = ["SurveyTake"]

CHUNK = TICKS_PER_S // 4
PAUSE = 3 * TICKS_PER_S // 2
"""Ticks that stand for what was left out: more than the second that up is measured over."""
HITS = 8
"""Hits of a station in a quarter of a second, on both its axes: it is in view."""
MOVING_RAD_S, MOVING_G = 0.05, 0.02
"""Spread of the IMU within a quarter of a second; a tenth of that is noise."""
RESTS = 4
"""Chunks that are kept when it comes to rest."""
MOST_CHUNKS = 240
"""A minute of moving: more tells nothing new."""


@dataclass(frozen=True, slots=True, eq=False)
class _Chunk:
    imu: ImuSamples
    angles: Angles
    stations: frozenset[int]
    moving: bool


class SurveyTake:
    """Collects one device's light.

    Attributes:
        moved: quarters of a second of moving so far, also those that are kept no longer.
    """

    def __init__(self, model: DeviceModel) -> None:
        """Nothing was seen."""
        self.model = model
        self._imu: list[ImuSamples] = []
        self._angles: list[Angles] = []
        self._chunks: deque[_Chunk] = deque(maxlen=MOST_CHUNKS)
        self._offset = 0
        self._newest: int | None = None
        self._rests = self.moved = 0

    def add(self, decoded: Decoded) -> bool:
        """The next batch of the device; True: something was kept."""
        if len(decoded.imu):
            if self._imu and not 0 < decoded.imu.ticks[0] - self._imu[-1].ticks[-1] < CHUNK:
                self._imu, self._angles = [], []  # it was silent, or its clock began anew
            self._imu.append(decoded.imu)
        if len(decoded.angles):
            self._angles.append(decoded.angles)
        if not self._imu or self._imu[-1].ticks[-1] - self._imu[0].ticks[0] < CHUNK:
            return False
        return self._close_chunk()

    @property
    def seen(self) -> list[frozenset[int]]:
        """The stations in view, for each quarter of a second of moving."""
        return [chunk.stations for chunk in self._chunks if chunk.moving]

    @property
    def in_view(self) -> frozenset[int]:
        """The stations in view in the newest quarter of a second that was kept."""
        return self._chunks[-1].stations if self._chunks else frozenset()

    def take(self) -> Take:
        """All that was kept."""
        chunks = list(self._chunks)
        return Take(
            self.model,
            ImuSamples.join([chunk.imu for chunk in chunks]),
            join_angles([chunk.angles for chunk in chunks]),
        )

    def _close_chunk(self) -> bool:
        imu, angles = ImuSamples.join(self._imu), Angles.join(self._angles)
        self._imu, self._angles = [], []
        moving = _moves(imu)
        self._rests = 0 if moving else self._rests + 1
        stations = frozenset(int(n) for n in np.unique(angles.station) if _in_view(angles, int(n)))
        if not stations or self._rests > RESTS:
            return False
        if self._newest is not None:
            since = int(imu.ticks[0]) + self._offset - self._newest
            self._offset += 0 if 0 < since <= PAUSE else PAUSE - since
        self._newest = int(imu.ticks[-1]) + self._offset
        self.moved += moving
        self._chunks.append(
            _Chunk(
                replace(imu, ticks=imu.ticks + self._offset),
                replace(angles, ticks=angles.ticks + self._offset),
                stations,
                moving,
            )
        )
        return True


def _moves(imu: ImuSamples) -> bool:
    turns = imu.gyro_rad_s.std(axis=0).max() > MOVING_RAD_S
    return bool(turns or imu.acc_g.std(axis=0).max() > MOVING_G)


def _in_view(angles: Angles, station: int) -> bool:
    axes = angles.axis[angles.station == station]
    return len(axes) >= HITS and bool(axes.min() != axes.max())
