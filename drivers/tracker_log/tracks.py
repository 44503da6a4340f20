"""A tracker log in memory: arrays per tracker, so an hour stays small."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lobstr_hw.drivers.driver import DeviceEvent
from lobstr_hw.drivers.tracker_log.messages import DeviceState
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array, from_quat_xyzw
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

__all__ = ["STATES", "SkeletonTrack", "StateChange", "TrackerLog", "TrackerTrack", "TruthTrack"]

STATES = tuple(TrackingState)
BLOCK = 2048
"""Samples whose rotations are converted at a time."""


@dataclass(frozen=True, slots=True)
class StateChange:
    """From ``time_s`` on, ``device`` holds."""

    time_s: float
    device: DeviceState


@dataclass(frozen=True, slots=True, eq=False)
class TrackerTrack:
    """All samples of one tracker.

    Attributes:
        serial: of the device.
        times_s: (m,) seconds, ascending.
        p: (m, 3) metres; NaN where unknown or broken.
        quat_xyzw: (m, 4); NaN where broken.
        has_p: (m,) whether the device knows its position at all.
        tracked: (m,) the device sees itself.
        state: (m,) index in :data:`STATES`.
        velocity: (m, 3) with NaN where not given, or None.
        covariance: (m, 6, 6) with NaN where not given, or None.
        states: the state messages, oldest first.
    """

    serial: str
    times_s: Array
    p: Array
    quat_xyzw: Array
    has_p: npt.NDArray[np.bool_]
    tracked: npt.NDArray[np.bool_]
    state: npt.NDArray[np.int8]
    velocity: Array | None
    covariance: Array | None
    states: tuple[StateChange, ...]

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.times_s)

    @property
    def role(self) -> TrackerRole | None:
        """The body part that the log names last."""
        roles = [change.device.role for change in self.states if change.device.role]
        return roles[-1] if roles else None

    def device_at(self, time_s: float) -> DeviceState:
        """What holds at a time; the first message holds before it too."""
        held = [change.device for change in self.states if change.time_s <= time_s]
        if held:
            return held[-1]
        return self.states[0].device if self.states else DeviceState()

    def samples(self, start: int = 0, stop: int | None = None) -> list[TrackerSample]:
        """The samples of a range of rows."""
        rows = range(len(self))[start:stop]
        R = self.rotations(rows.start, rows.stop)
        return [self._sample(row, R[row - rows.start]) for row in rows]

    def rotations(self, start: int = 0, stop: int | None = None) -> Array:
        """Rotations (m, 3, 3) of a range of rows; NaN where broken."""
        q = self.quat_xyzw[start:stop]
        broken = np.isnan(q.sum(axis=-1))
        R = from_quat_xyzw(np.where(broken[:, None], [0.0, 0.0, 0.0, 1.0], q))
        R[broken] = np.nan
        return R

    def _sample(self, row: int, R: Array) -> TrackerSample:
        return TrackerSample(
            self.serial,
            PartialPose(R, self.p[row] if self.has_p[row] else None),
            float(self.times_s[row]),
            bool(self.tracked[row]),
            STATES[self.state[row]],
            _given(self.velocity, row),
            _given(self.covariance, row),
        )


def _given(values: Array | None, row: int) -> Array | None:
    if values is None or np.isnan(values[row]).all():
        return None
    return np.array(values[row])


@dataclass(frozen=True, slots=True, eq=False)
class TruthTrack:
    """The body a made log was made from, in tracking space and the user's metres.

    Attributes:
        times_s: (f,) seconds.
        p_world: (f, 22, 3) joints, float32 precision.
        R_world: (f, 22, 3, 3), or None.
    """

    times_s: Array
    p_world: Array
    R_world: Array | None


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonTrack:
    """The bodies that were sent out.

    Attributes:
        times_s: (f,) seconds.
        p_local: (f, 22, 3) each joint in its parent, the hips in the world, the user's metres.
        R_local: (f, 22, 3, 3) likewise.
        contact: (f, 2) left and right foot on the floor; None where the log does not say.
        roles: per frame, how each role fared.
    """

    times_s: Array
    p_local: Array
    R_local: Array
    contact: npt.NDArray[np.bool_] | None
    roles: tuple[dict[str, str], ...]


@dataclass(frozen=True, slots=True, eq=False)
class TrackerLog:
    """What a log holds. Times are seconds from its first tracker message.

    Attributes:
        path: of the file.
        trackers: one track each, in the order of their first message.
        t_pose_s: start and end of the T-pose, where the log marks one.
        start_s: the first message on the clock of the recording.
        unix_offset_s: what to add to that clock for UNIX time, where the log tells it.
        metadata: all words about the recording.
        profile: the calibration profile's bytes, where one is attached.
        truth: of a made log.
        skeleton: of a log recorded with the avatar.
        events: of no single tracker, oldest first: the play space was set up anew, commands.
        damage: why the reading ended before the file's end, or "".
    """

    path: Path
    trackers: tuple[TrackerTrack, ...]
    t_pose_s: tuple[float, float] | None
    start_s: float
    unix_offset_s: float | None
    metadata: dict[str, dict[str, str]]
    profile: bytes | None
    truth: TruthTrack | None
    skeleton: SkeletonTrack | None
    events: tuple[DeviceEvent, ...]
    damage: str

    @property
    def cut(self) -> bool:
        """The file ended early; what was read is in order."""
        return bool(self.damage)

    @property
    def duration_s(self) -> float:
        """Time of the last sample."""
        return max(float(track.times_s[-1]) for track in self.trackers)

    def tracker(self, serial: str) -> TrackerTrack:
        """The track of a serial; KeyError when there is none."""
        return {track.serial: track for track in self.trackers}[serial]

    def samples(self) -> Iterator[TrackerSample]:
        """All samples, oldest first; equal times in the order of the trackers."""
        times = np.concatenate([track.times_s for track in self.trackers])
        owner = np.repeat(np.arange(len(self.trackers)), [len(track) for track in self.trackers])
        order = np.argsort(times, kind="stable")
        first = [0] * len(self.trackers)
        for start in range(0, len(order), BLOCK):
            block = owner[order[start : start + BLOCK]]
            blocks = []
            for i, track in enumerate(self.trackers):
                stop = first[i] + int(np.sum(block == i))
                blocks.append(iter(track.samples(first[i], stop)))
                first[i] = stop
            for i in block:
                yield next(blocks[i])
