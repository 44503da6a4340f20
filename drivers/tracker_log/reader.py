"""Reading a tracker log: as far as it goes, and it says how far that was."""

from __future__ import annotations  # array is subscriptable from Python 3.12 on only

import math
from array import array
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema

from lobstr_hw.drivers.driver import DeviceEvent
from lobstr_hw.drivers.tracker_log import schemas
from lobstr_hw.drivers.tracker_log.container import RecordFile
from lobstr_hw.drivers.tracker_log.messages import (
    DeviceState,
    PoseReading,
    SkeletonReading,
    TruthReading,
    read_event,
    read_pose,
    read_skeleton,
    read_state,
    read_truth,
    seconds,
)
from lobstr_hw.drivers.tracker_log.tracks import (
    STATES,
    SkeletonTrack,
    StateChange,
    TrackerLog,
    TrackerTrack,
    TruthTrack,
)
from lobstr_hw.drivers.tracker_log.writer import CLOCK, PROFILE_ATTACHMENT, T_POSE
from lobstr_hw.errors import LogFileError
from lobstr_hw.rotations import Array, from_quat_xyzw

__all__ = ["read_log"]

_NAN = math.nan


def read_log(path: str | Path, skeleton: bool = True) -> TrackerLog:
    """Read a log; a cut or damaged one as far as it goes (``damage`` tells why it ended).

    Args:
        path: of the file.
        skeleton: read the bodies that were sent out, too; they are most of a long recording.

    Raises:
        LogFileError: no such file, not MCAP, or no tracker in it.
    """
    file = RecordFile(Path(path))
    content = _Content(skeleton)
    for count, record in enumerate(file):
        try:
            content.add(record)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            file.damage = f"record {count} is not what its topic says ({error!r})"
            break
    return content.log(file.path, file.damage)


@dataclass(slots=True)
class _TrackRows:
    """Grows by one tracker's messages; flat C arrays, 130 bytes a sample."""

    serial: str
    times_ns: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))  # p, quat_xyzw
    flags: array[int] = field(default_factory=lambda: array("b"))  # has_p, tracked, state
    velocity: array[float] = field(default_factory=lambda: array("d"))
    covariance: array[float] = field(default_factory=lambda: array("d"))
    held: DeviceState = field(default_factory=DeviceState)
    states: list[tuple[int, DeviceState]] = field(default_factory=list)
    lost: tuple[int, DeviceState] | None = None  # told by no pose yet

    def add_pose(self, time_ns: int, data: bytes) -> None:
        pose = read_pose(data)
        if self.lost and self.lost[0] == time_ns:
            self.lost = None  # this pose tells it
        self.add_loss()
        self._append(time_ns, pose, self.held)

    def add_state(self, time_ns: int, data: bytes) -> None:
        before, self.held = self.held, read_state(data)
        self.states.append((time_ns, self.held))
        changed = (before.tracked, before.state) != (self.held.tracked, self.held.state)
        if changed and not self.held.tracked:
            self.add_loss()
            self.lost = time_ns, self.held

    def add_loss(self) -> None:
        """The device told of a loss without a pose: a sample at its last pose says so."""
        if self.lost and self.times_ns:
            p = tuple(self.values[-7:-4]) if self.flags[-3] else None
            self._append(self.lost[0], PoseReading(p, tuple(self.values[-4:])), self.lost[1])
        self.lost = None

    def _append(self, time_ns: int, pose: PoseReading, device: DeviceState) -> None:
        rows = len(self.times_ns)
        self.times_ns.append(time_ns)
        self.values.extend((*(pose.p or (_NAN,) * 3), *pose.quat_xyzw))
        self.flags.extend((pose.p is not None, device.tracked, STATES.index(device.state)))
        _extend(self.velocity, pose.velocity, 3, rows)
        _extend(self.covariance, pose.covariance, 36, rows)

    def track(self, start_ns: int) -> TrackerTrack:
        times = np.frombuffer(self.times_ns, np.int64)
        order = np.argsort(times, kind="stable")
        values = np.frombuffer(self.values).reshape(-1, 7)[order]
        flags = np.frombuffer(self.flags, np.int8).reshape(-1, 3)[order]
        return TrackerTrack(
            self.serial,
            (times[order] - start_ns) / 1e9,
            np.ascontiguousarray(values[:, :3]),
            np.ascontiguousarray(values[:, 3:]),
            flags[:, 0].astype(bool),
            flags[:, 1].astype(bool),
            flags[:, 2],
            _column(self.velocity, (3,), order),
            _column(self.covariance, (6, 6), order),
            tuple(StateChange(seconds(t - start_ns), device) for t, device in self.states),
        )


def _extend(column: array[float], values: tuple[float, ...] | None, width: int, rows: int) -> None:
    """Add a row to an optional column, which begins at its first value."""
    if values is None and not column:
        return
    if not column:
        column.extend((_NAN,) * (width * rows))
    row = (_NAN,) * width if values is None else values
    if len(row) != width:
        raise ValueError(f"expected {width} numbers, got {len(row)}")
    column.extend(row)


def _column(
    values: array[float], shape: tuple[int, ...], order: np.ndarray[tuple[int], np.dtype[np.intp]]
) -> Array | None:
    return np.frombuffer(values).reshape(-1, *shape)[order] if values else None


class _Content:
    """Sorts records by topic."""

    def __init__(self, with_skeleton: bool) -> None:
        self.with_skeleton = with_skeleton
        self.schemas: dict[int, str] = {}
        self.topics: dict[int, tuple[str, str]] = {}  # and the name of the schema
        self.trackers: dict[str, _TrackRows] = {}
        self.truth: list[tuple[int, TruthReading]] = []
        self.skeleton: list[tuple[int, SkeletonReading]] = []
        self.events: list[tuple[int, DeviceEvent]] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.profile: bytes | None = None

    def add(self, record: McapRecord) -> None:
        if isinstance(record, Message):
            self._add_message(*self.topics[record.channel_id], record.log_time, record.data)
        elif isinstance(record, Schema):
            self.schemas[record.id] = record.name
        elif isinstance(record, Channel):
            name = self.schemas.get(record.schema_id, "")
            self.topics[record.id] = record.topic, name if record.message_encoding == "json" else ""
        elif isinstance(record, Metadata):
            self.metadata[record.name] = record.metadata
        elif isinstance(record, Attachment) and record.name == PROFILE_ATTACHMENT:
            self.profile = record.data

    def _add_message(self, topic: str, schema: str, time_ns: int, data: bytes) -> None:
        serial = schemas.serial_of_topic(topic)
        if serial and schema == schemas.POSE_IN_FRAME:
            self._rows(serial).add_pose(time_ns, data)
        elif serial and schema == schemas.TRACKER_STATE:
            self._rows(serial).add_state(time_ns, data)
        elif (topic, schema) == (schemas.TRUTH_TOPIC, schemas.TRUTH):
            self.truth.append((time_ns, read_truth(data)))
        elif (topic, schema) == (schemas.SKELETON_TOPIC, schemas.FRAME_TRANSFORMS):
            if self.with_skeleton:
                self.skeleton.append((time_ns, read_skeleton(data)))
        elif (topic, schema) == (schemas.EVENTS_TOPIC, schemas.EVENT):
            if (event := read_event(seconds(time_ns), data)) is not None:
                self.events.append((time_ns, event))

    def _rows(self, serial: str) -> _TrackRows:
        return self.trackers.setdefault(serial, _TrackRows(serial))

    def log(self, path: Path, damage: str) -> TrackerLog:
        for rows in self.trackers.values():
            rows.add_loss()
        trackers = [rows for rows in self.trackers.values() if rows.times_ns]
        if not trackers:
            raise LogFileError(
                f"{path} holds no tracker poses (topics seen: {self._seen()}). "
                "A tracker log has topics /trackers/SERIAL of foxglove.PoseInFrame in JSON."
            )
        start_ns = min(min(rows.times_ns) for rows in trackers)
        return TrackerLog(
            path=path,
            trackers=tuple(rows.track(start_ns) for rows in trackers),
            t_pose_s=self._t_pose(seconds(start_ns)),
            start_s=seconds(start_ns),
            unix_offset_s=self._number(CLOCK, "unix_offset_s"),
            metadata=self.metadata,
            profile=self.profile,
            truth=self._truth_track(start_ns),
            skeleton=self._skeleton_track(start_ns),
            events=self._events(start_ns),
            damage=damage,
        )

    def _seen(self) -> str:
        return ", ".join(sorted(topic for topic, _ in self.topics.values())) or "none"

    def _number(self, name: str, key: str) -> float | None:
        text = self.metadata.get(name, {}).get(key)
        try:
            return None if text is None else float(text)
        except ValueError:
            return None

    def _t_pose(self, start_s: float) -> tuple[float, float] | None:
        start, end = self._number(T_POSE, "start_s"), self._number(T_POSE, "end_s")
        if start is None or end is None:
            return None
        return start - start_s, end - start_s

    def _events(self, start_ns: int) -> tuple[DeviceEvent, ...]:
        timed = sorted(self.events, key=lambda item: item[0])  # stable
        return tuple(replace(event, time_s=seconds(t - start_ns)) for t, event in timed)

    def _truth_track(self, start_ns: int) -> TruthTrack | None:
        if not self.truth:
            return None
        times, readings = zip(*self.truth, strict=True)
        steps = [r.quat_steps for r in readings if r.quat_steps is not None]
        whole = len(steps) == len(readings)
        return TruthTrack(
            (np.array(times) - start_ns) / 1e9,
            np.stack([r.p_world for r in readings]).astype(np.float64),
            from_quat_xyzw(np.stack(steps).astype(np.float64)) if whole else None,
        )

    def _skeleton_track(self, start_ns: int) -> SkeletonTrack | None:
        if not self.skeleton:
            return None
        times, readings = zip(*self.skeleton, strict=True)
        contact = [r.contact for r in readings if len(r.contact) == 2]
        return SkeletonTrack(
            (np.array(times) - start_ns) / 1e9,
            np.stack([r.p_local for r in readings]),
            from_quat_xyzw(np.stack([r.quat_xyzw for r in readings])),
            np.array(contact) if len(contact) == len(readings) else None,
            tuple(r.roles for r in readings),
        )
