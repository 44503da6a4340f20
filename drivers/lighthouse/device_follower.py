"""What follows from a device's reports: readings, buttons, stations heard, what it sees. Pure."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, DeviceModel, StationCalibration
from lobstr_hw.drivers.lighthouse.buttons import held_buttons
from lobstr_hw.drivers.lighthouse.decoding import Decoded
from lobstr_hw.drivers.lighthouse.imu import ImuRanges
from lobstr_hw.drivers.lighthouse.light_mode import LightMode
from lobstr_hw.drivers.lighthouse.sight import Sight
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.tracker_state import Fix
from lobstr_hw.drivers.lighthouse.transport import RawReport
from lobstr_hw.drivers.reading_thread import Arrival, Reading
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import TrackingState

__all__ = ["About", "DeviceFollower", "Heard", "News", "Seen"]

STATE_TICKS = TICKS_PER_S // 10
"""Between two samples of a device that has no pose yet."""
NOWHERE = PartialPose(np.eye(3), None)


@dataclass(frozen=True, slots=True, eq=False)
class About:
    """What a device said when it was asked.

    Attributes:
        model: from its configuration.
        firmware: its version, or empty.
        ranges: of its IMU, or None: not told.
        mode: of its light.
    """

    model: DeviceModel
    firmware: str
    ranges: ImuRanges | None
    mode: LightMode


@dataclass(frozen=True, slots=True, eq=False)
class Heard:
    """A station said who it is."""

    number: int
    calibration: StationCalibration


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What a device saw, for finding out where the stations stand."""

    serial: str
    model: DeviceModel
    decoded: Decoded


News = Arrival | Heard | Seen


class DeviceFollower:
    """Takes the reports of one device in their order."""

    def __init__(self, tracked: TrackedDevice, about: About, sight: Sight, clock: str) -> None:
        """Nothing was heard.

        Args:
            tracked: the device; ``decoded`` of it is taken.
            about: what it said.
            sight: is kept up to date.
            clock: name of the device's clock, another one each time that it is switched on.
        """
        self._tracked, self._about, self._sight, self._clock = tracked, about, sight, clock
        self._batches: list[Decoded] = []
        tracked.decoded = self._batches.append
        self._buttons: frozenset[str] = frozenset()
        self._told = -STATE_TICKS
        self._switch = False

    def wants_other_light(self) -> bool:
        """Whether the light mode, ``about.mode.gen2``, changed with the last report."""
        switch, self._switch = self._switch, False
        return switch

    def feed(self, report: RawReport, surveyed: bool) -> Iterator[News]:
        """The next report, and what follows from it; ``surveyed``: say what it sees, too."""
        self._tracked.feed(report.data)
        buttons = held_buttons(self._tracked.reader, self._about.model.model)
        if buttons != self._buttons:
            self._buttons = buttons
            yield self._reading(None, TrackingState.OK, None, report, buttons=buttons)
        batches = self._batches.copy()
        self._batches.clear()
        for batch in batches:
            yield from self._saw(batch, surveyed)
        if batches:
            yield from self._poses(report)

    def _saw(self, batch: Decoded, surveyed: bool) -> Iterator[News]:
        newest = self._tracked.reader.newest_tick or 0
        self._sight.add(batch.angles, newest)
        for number, calibration in batch.stations.items():
            yield Heard(number, calibration)
        if surveyed:
            yield Seen(self._about.model.serial, self._about.model, batch)
        sees_gen2 = self._tracked.reader.sees_gen2
        self._switch |= self._about.mode.switch(newest, len(batch.angles), sees_gen2)

    def _poses(self, report: RawReport) -> Iterator[News]:
        poses = self._tracked.poses()
        newest = self._tracked.reader.newest_tick or 0
        unseen = TrackingState.OCCLUDED if self._tracked.stations else TrackingState.CALIBRATING
        if len(poses):
            self._told = newest
            yield from self._readings(poses, unseen, report)
        elif newest - self._told >= STATE_TICKS:
            self._told = newest
            yield self._reading(NOWHERE, unseen, newest / TICKS_PER_S, report)

    def _readings(
        self, poses: TimedPoses, unseen: TrackingState, report: RawReport
    ) -> Iterator[Reading]:
        times = poses.time_s.tolist()
        for k, fix in enumerate(poses.fix.tolist()):
            pose = PartialPose(poses.R[k], poses.p[k])
            state = unseen if fix == Fix.LOST else TrackingState.OK
            yield self._reading(
                pose, state, times[k], report, poses.velocity[k], poses.covariance[k]
            )

    def _reading(
        self,
        pose: PartialPose | None,
        state: TrackingState,
        device_s: float | None,
        report: RawReport,
        velocity: Array | None = None,
        covariance: Array | None = None,
        buttons: frozenset[str] | None = None,
    ) -> Reading:
        return Reading(
            self._about.model.serial, pose, state, device_s, buttons,
            velocity, covariance, self._clock, report.arrived_s,
        )  # fmt: skip
