"""Writing a tracker log: nothing waits in memory while recording, compressed on a clean close."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from mcap.writer import CompressionType, Writer

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.tracker_log import schemas
from lobstr_hw.drivers.tracker_log.container import LIBRARY, PROFILE, RecordFile, copy_compressed
from lobstr_hw.drivers.tracker_log.messages import (
    DeviceState,
    event_message,
    nanoseconds,
    pose_message,
    skeleton_message,
    state_message,
    truth_message,
)
from lobstr_hw.errors import LogFileError
from lobstr_hw.rotations import Array, to_quat_xyzw
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

__all__ = ["CLOCK", "PROFILE_ATTACHMENT", "T_POSE", "TrackerLogWriter"]

T_POSE = "t_pose"
CLOCK = "clock"
PROFILE_ATTACHMENT = "profile.json"


class TrackerLogWriter:
    """Writes samples as the driver gave them, and what belongs to them.

    While recording, every call ends with all its bytes handed to the operating system, outside of
    any chunk: a killed process loses nothing but the call it was in. A clean ``close`` rewrites the
    file compressed, in one step. Times are on the one host clock, from 0 up.
    """

    def __init__(self, path: str | Path) -> None:
        """Begin the file.

        Raises:
            LogFileError: it cannot be written.
        """
        self.path = Path(path)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._states: dict[str, DeviceState] = {}
        try:
            self._stream = self.path.open("wb")
        except OSError as error:
            raise LogFileError(
                f"{self.path} cannot be written: {error.strerror or error}. "
                "Choose another folder, or make this one first."
            ) from error
        # one chunk of 1 MB would keep everything of a short session until its end
        self._writer = Writer(self._stream, compression=CompressionType.NONE, use_chunking=False)
        self._writer.start(PROFILE, LIBRARY)
        self._stream.flush()

    def add_sample(self, sample: TrackerSample) -> None:
        """One reading; a change of ``tracked`` or ``state`` is written before it."""
        self.add_samples((sample,))

    def add_samples(self, samples: Sequence[TrackerSample]) -> None:
        """Several readings, oldest first; much faster than one by one."""
        if not samples:
            return
        for sample, q in zip(samples, _quaternions(samples), strict=True):
            time_ns = nanoseconds(sample.time_s)
            self._hold(sample, time_ns)
            data = pose_message(time_ns, sample, q)
            self._add(schemas.pose_topic(sample.serial), schemas.POSE_IN_FRAME, time_ns, data)
        self._stream.flush()

    def add_state(
        self,
        serial: str,
        role: TrackerRole | None,
        state: TrackingState,
        tracked: bool,
        time_s: float,
        battery: float | None = None,
        buttons: tuple[str, ...] = (),
    ) -> None:
        """What holds for a tracker from now on; written only where it says something new."""
        device = DeviceState(role, tracked, state, battery, buttons)
        self._add_state(serial, device, nanoseconds(time_s))
        self._stream.flush()

    def add_event(self, event: DeviceEvent) -> None:
        """Something happened: buttons become a state of their tracker, once it has one.

        Notices are left out, for their words are of the moment; what becomes of a tracker stands in
        its samples.
        """
        time_ns, held = nanoseconds(max(event.time_s, 0.0)), self._states.get(event.serial)
        if event.kind in (EventKind.RECENTRED, EventKind.COMMAND):
            data = event_message(time_ns, event)
            self._add(schemas.EVENTS_TOPIC, schemas.EVENT, time_ns, data)
        elif held and event.kind in (EventKind.BUTTON_DOWN, EventKind.BUTTON_UP):
            kept = set(held.buttons) - {event.name}
            down = {event.name} if event.kind is EventKind.BUTTON_DOWN else set()
            device = replace(held, buttons=tuple(sorted(kept | down)))
            self._add_state(event.serial, device, time_ns)
        self._stream.flush()

    def buttons(self, serial: str) -> tuple[str, ...]:
        """Those of a tracker that are held down, as far as was written."""
        held = self._states.get(serial)
        return () if held is None else held.buttons

    def add_skeleton(self, pose: SkeletonPose) -> None:
        """The body as it was sent out."""
        time_ns = nanoseconds(pose.time_s)
        data = skeleton_message(time_ns, pose)
        self._add(schemas.SKELETON_TOPIC, schemas.FRAME_TRANSFORMS, time_ns, data)
        self._stream.flush()

    def add_truth(self, time_s: float, p_world: Array, R_world: Array | None = None) -> None:
        """The body that a made log was made from.

        Args:
            time_s: of the frame.
            p_world: (22, 3) joints in tracking space, metres.
            R_world: (22, 3, 3) their rotations.
        """
        time_ns = nanoseconds(time_s)
        data = truth_message(time_ns, p_world, R_world)
        self._add(schemas.TRUTH_TOPIC, schemas.TRUTH, time_ns, data)
        self._stream.flush()

    def attach_profile(self, data: bytes) -> None:
        """The calibration profile in use, as its file's bytes."""
        self._writer.add_attachment(0, 0, PROFILE_ATTACHMENT, "application/json", data)
        self._stream.flush()

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """Words about the recording; MCAP metadata are strings."""
        self._writer.add_metadata(name, values)
        self._stream.flush()

    def mark_t_pose(self, start_s: float, end_s: float) -> None:
        """The user stands in a T-pose between these times."""
        self.metadata(T_POSE, {"start_s": f"{start_s:.9f}", "end_s": f"{end_s:.9f}"})

    def mark_clock(self, unix_offset_s: float) -> None:
        """What to add to this log's times for UNIX time."""
        self.metadata(CLOCK, {"unix_offset_s": f"{unix_offset_s:.9f}"})

    def close(self) -> None:
        """Finish the file and rewrite it compressed; twice is harmless."""
        if self._stream.closed:
            return
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.close()
        copy_compressed(RecordFile(self.path), self.path)

    def abandon(self) -> None:
        """Leave the file as a kill would: when the disk is full, finishing needs space too."""
        with suppress(OSError):  # of the bytes that had no room; the file is closed all the same
            self._stream.close()

    def __enter__(self) -> Self:
        """The writer itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close, whatever happened."""
        self.close()

    def _hold(self, sample: TrackerSample, time_ns: int) -> None:
        held = self._states.get(sample.serial)
        if held and (held.tracked, held.state) == (sample.tracked, sample.state):
            return
        held = held or DeviceState()
        device = DeviceState(held.role, sample.tracked, sample.state, held.battery, held.buttons)
        self._add_state(sample.serial, device, time_ns)

    def _add_state(self, serial: str, device: DeviceState, time_ns: int) -> None:
        if self._states.get(serial) == device:
            return
        self._states[serial] = device
        topic = schemas.state_topic(serial)
        self._add(topic, schemas.TRACKER_STATE, time_ns, state_message(time_ns, device))

    def _add(self, topic: str, schema: str, time_ns: int, data: bytes) -> None:
        channel = self._channels.get(topic) or self._register(topic, schema)
        self._writer.add_message(channel, time_ns, data, time_ns)

    def _register(self, topic: str, schema: str) -> int:
        if schema not in self._schemas:
            text = schemas.schema_text(schema)
            self._schemas[schema] = self._writer.register_schema(schema, "jsonschema", text)
        channel = self._writer.register_channel(topic, "json", self._schemas[schema])
        self._channels[topic] = channel
        return channel


def _quaternions(samples: Sequence[TrackerSample]) -> list[list[float]]:
    R = np.stack([sample.T_world_tracker.R for sample in samples])
    broken = ~(np.abs(R).sum(axis=(-2, -1)) < np.inf)  # NaN and infinity
    q = to_quat_xyzw(np.where(broken[:, None, None], np.eye(3), R))
    q[broken] = np.nan
    return [list(row) for row in q.tolist()]
