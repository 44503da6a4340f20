"""A bounded queue and a writing thread before a file, so that the loop never waits for a disk.

Nothing is dropped: when the queue is full (a stalled disk, or ``--fast`` outrunning the writer) the
loop waits, and memory stays bounded.
"""

import queue
import threading
from collections.abc import Callable, Sequence

from lobstr_hw.errors import LobstrError, OutputError
from lobstr_hw.runtime.outputs.output import Output
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample

__all__ = ["QUEUED_FRAMES", "QueuedOutput"]

QUEUED_FRAMES = 512
"""11 s at 45 Hz; some 5 MB."""


class QueuedOutput:
    """Any output, written by a thread of its own in the order of the calls.

    Attributes:
        name: for messages.
        failure: why writing stopped; None while all is well.
    """

    def __init__(self, name: str, sink: Output, tell: Callable[[str], None]) -> None:
        """Put a queue before a sink.

        Args:
            name: how the user knows it, ``bvh:out.bvh``.
            sink: does the writing.
            tell: is told once when the sink dies.
        """
        self.name = name
        self.failure: Exception | None = None
        self._sink = sink
        self._tell = tell
        self._calls: queue.Queue[Callable[[], None] | None] = queue.Queue(QUEUED_FRAMES)
        self._thread = threading.Thread(target=self._write, name=name, daemon=True)
        self._open = False

    @property
    def backlog(self) -> int:
        """Calls that wait to be written."""
        return self._calls.qsize()

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Open the sink here and now, so that its errors come before anything starts."""
        self._sink.open(body, rate_hz, take)
        self._open = True
        self._thread.start()

    def calibrated(self, body: Body) -> None:
        """Pass on the sizes."""
        self._calls.put(lambda: self._sink.calibrated(body))

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        """Pass on a tick."""
        self._calls.put(lambda: self._sink.send(pose, samples))

    def close(self) -> None:
        """Wait until all is written, and close.

        Raises:
            OutputError: when something could not be written.
        """
        if self._open:
            self._open = False
            self._calls.put(None)
            self._thread.join()
            self._attempt(self._sink.close)
        if self.failure is None:
            return
        if not isinstance(self.failure, (OSError, LobstrError)):
            raise self.failure
        raise OutputError(
            f"{self.name} is incomplete: {self.failure}. "
            "Free some space or choose another place, and run again."
        ) from self.failure

    def _write(self) -> None:
        while (call := self._calls.get()) is not None:
            if self.failure is None:
                self._attempt(call)

    def _attempt(self, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:  # the queue must go on being emptied, or the loop would wait
            if self.failure is None:
                self.failure = error
                self._tell(f"{self.name}: writing failed, nothing more goes there: {error}")
