"""Reports of one device in, its timed poses out: one way for what comes live and what is on file.

    report ──► DeviceReader ─► every 12 ms of device time ─► DeviceDecoder ─► tracker.step ─► poses

What was heard is worked through at fixed places of the device's own time, each as soon as an IMU
sample has passed it. So poses follow from the order of the reports and from nothing else: neither
from when a packet came, nor from how many were handed over at once.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import (
    TICKS_PER_S,
    DeviceModel,
    StationCalibration,
)
from lobstr_hw.drivers.lighthouse.decoding import Decoded, DeviceDecoder
from lobstr_hw.drivers.lighthouse.device_reader import DeviceReader
from lobstr_hw.drivers.lighthouse.imu import ImuRanges
from lobstr_hw.drivers.lighthouse.light import Stations, join_angles, take_angles
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses, timed_poses
from lobstr_hw.drivers.lighthouse.tracker import (
    PoseBatch,
    TrackerSettings,
    TrackerState,
    begin,
    join_poses,
    step,
)

__all__ = ["TrackedDevice"]

STEP = 12 * TICKS_PER_S // 1000
"""Ticks between two places: the length of the tracker's windows of light."""
LONGEST = TICKS_PER_S
"""The tracker is given no more at once; it copies what it has not used at every window."""


class TrackedDevice:
    """One device that is being tracked.

    Attributes:
        reader: the device's own words: buttons, battery, whether it is switched off.
        heard: what stations said about themselves, by number.
        decoded: is shown every batch of hits and IMU samples, if not None.
    """

    def __init__(
        self,
        model: DeviceModel,
        stations: Stations,
        ranges: ImuRanges | None = None,
        reader: DeviceReader | None = None,
        settings: TrackerSettings | None = None,
    ) -> None:
        """Nothing was heard.

        Args:
            model: the device.
            stations: those whose place is known, by number.
            ranges: of its IMU; None: the usual ones of such a device.
            reader: one that is fed already, or None: a new one, of a device by cable.
            settings: of the tracking.
        """
        self.model = model
        self.reader = reader or DeviceReader(old_radio=False, gen2_light=False)
        self.heard: dict[int, StationCalibration] = {}
        self.decoded: Callable[[Decoded], None] | None = None
        self._stations = stations
        self._settings = settings or TrackerSettings()
        self._decoder = DeviceDecoder(model, ranges)
        self._state = begin()
        self._given: list[PoseBatch] = []
        self._place: int | None = None

    @property
    def stations(self) -> Stations:
        """Those that it is tracked by."""
        return self._stations

    def use_stations(self, stations: Stations, same_world: bool = True) -> None:
        """From now on be tracked by these.

        Args:
            stations: by number.
            same_world: what was tracked so far is still true.
        """
        self._stations = stations
        self._state = _without_others(self._state, stations) if same_world else begin()

    def feed(self, report: bytes) -> None:
        """The next input report; what is no report of such a device is left alone."""
        self.reader.feed(report)
        self.advance()

    def advance(self) -> None:
        """Work through what the reader holds, if the device's time has come far enough."""
        newest = self.reader.newest_tick
        if newest is None:
            return
        place = newest // STEP
        if place != self._place:
            self._place = place
            self._take(self.reader.take())

    def feed_events(self, events: RawEvents) -> None:
        """A whole recording of raw events, the order of whose kinds is not known."""
        self._take(events)

    def _take(self, events: RawEvents) -> None:
        decoded = self._decoder.decode(events)
        self.heard.update(decoded.stations)
        if self.decoded is not None:
            self.decoded(decoded)
        for part in _pieces(decoded):
            self._state, batch = step(
                self._state, self.model, self._stations, part.imu, part.angles, self._settings
            )
            if len(batch):
                self._given.append(batch)

    def poses(self) -> TimedPoses:
        """What was found since the last call, oldest first."""
        given, self._given = self._given, []
        return timed_poses(join_poses(given), self.model)


def _without_others(state: TrackerState, stations: Stations) -> TrackerState:
    """Hits that wait to be used are those of these stations, too."""
    keep = np.isin(state.angles.station, list(stations))
    return replace(state, angles=take_angles(state.angles, keep))


def _pieces(decoded: Decoded) -> Iterator[Decoded]:
    """A long batch in pieces by time; light that is late for its piece comes with the next."""
    imu = decoded.imu
    if not len(imu) or imu.ticks[-1] - imu.ticks[0] <= LONGEST:
        yield decoded
        return
    angles = join_angles([decoded.angles])
    edges = np.append(np.arange(imu.ticks[0] + LONGEST, imu.ticks[-1], LONGEST), 2**62)
    i = j = 0
    for edge in edges:
        k, n = int(np.searchsorted(imu.ticks, edge)), int(np.searchsorted(angles.ticks, edge))
        part = imu.take(slice(i, k))
        yield Decoded(part, take_angles(angles, slice(j, n)), decoded.stations)
        i, j = k, n
