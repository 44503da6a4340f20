"""``mcap:FILE``: a tracker log with the skeleton in it; Foxglove and Rerun open it as it is."""

from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from lobstr_hw.drivers.driver import DeviceEvent
from lobstr_hw.drivers.tracker_log.writer import TrackerLogWriter
from lobstr_hw.errors import LogFileError, OutputError
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["McapOutput"]


class McapOutput:
    """Samples as the drivers gave them, before any maths, and the skeleton of every tick.

    Attributes:
        events: what happened and is to be written; whoever hears of it adds it, from any thread.
    """

    def __init__(
        self,
        path: Path,
        role_of: Callable[[str], TrackerRole | None],
        unix_offset_s: Callable[[float], float | None] = lambda time_s: None,
    ) -> None:
        """Choose the file.

        Args:
            path: to write.
            role_of: the role of a serial at this moment, if it has one.
            unix_offset_s: given the session time of now, what to add to session times for UNIX
                time; None where nobody knows, as in a made log.
        """
        self.path = path
        self._unix_offset_s = unix_offset_s
        self.events: deque[DeviceEvent] = deque()
        self._begun = False
        self._role_of = role_of
        self._writer: TrackerLogWriter | None = None
        self._roles: dict[str, TrackerRole] = {}

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Create the file."""
        try:
            self._writer = TrackerLogWriter(self.path)
        except LogFileError as error:
            raise OutputError(str(error)) from error
        self._writer.metadata("take", {"name": take, "rate_hz": f"{rate_hz:g}"})

    def calibrated(self, body: Body) -> None:
        """Nothing to do: transforms are written as they are."""

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        """What happened and the samples of a tick, a role where it is new, then the skeleton."""
        assert self._writer is not None
        if not self._begun:
            self._begun = True
            self._mark_clock(self._writer, pose.time_s)
        for sample in samples:
            self._note_role(self._writer, sample)
        self._note_events(self._writer)
        self._writer.add_samples(samples)
        self._writer.add_skeleton(pose)

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._note_events(self._writer)
            self._writer.close()
            self._writer = None

    def _mark_clock(self, writer: TrackerLogWriter, now_s: float) -> None:
        offset_s = self._unix_offset_s(now_s)
        if offset_s is not None:
            writer.mark_clock(offset_s)

    def _note_events(self, writer: TrackerLogWriter) -> None:
        while self.events:
            writer.add_event(self.events.popleft())

    def _note_role(self, writer: TrackerLogWriter, sample: TrackerSample) -> None:
        role = self._role_of(sample.serial)
        if role is not None and self._roles.get(sample.serial) != role:
            self._roles[sample.serial] = role
            writer.add_state(
                sample.serial,
                role,
                sample.state,
                sample.tracked,
                sample.time_s,
                buttons=writer.buttons(sample.serial),
            )
