import threading
from collections.abc import Sequence

import pytest
from support.poses import random_poses

from lobstr_hw.errors import OutputError
from lobstr_hw.runtime.outputs.queued import QUEUED_FRAMES, QueuedOutput
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample

BODY = Body.standard()
POSE = random_poses(1, 1, BODY)[0]


class Sink:
    """Remembers what it was told; can be made to wait, or to fail at a frame."""

    def __init__(self, fails_at: int | None = None, error: Exception | None = None) -> None:
        self.calls: list[str] = []
        self.frames = 0
        self.go = threading.Event()
        self.go.set()
        self.fails_at = fails_at
        self.error = error or OSError(28, "No space left on device")

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        self.calls.append("open")

    def calibrated(self, body: Body) -> None:
        self.calls.append("calibrated")

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        self.go.wait(10.0)
        if self.frames == self.fails_at:
            raise self.error
        self.frames += 1
        self.calls.append("send")

    def close(self) -> None:
        self.calls.append("close")


def opened(sink: Sink, told: list[str]) -> QueuedOutput:
    output = QueuedOutput("bvh:x", sink, told.append)
    output.open(BODY, 45.0, "take")
    return output


def test_calls_arrive_in_order_and_all_of_them() -> None:
    sink, told = Sink(), list[str]()
    output = opened(sink, told)
    output.send(POSE, ())
    output.calibrated(BODY)
    for _ in range(5000):
        output.send(POSE, ())
    output.close()
    output.close()
    assert sink.calls == ["open", "send", "calibrated"] + ["send"] * 5000 + ["close"]
    assert not told


def test_a_slow_writer_makes_the_loop_wait_and_memory_stays_bounded() -> None:
    sink = Sink()
    sink.go.clear()
    output = opened(sink, [])
    count = QUEUED_FRAMES + 50
    sent = []

    def loop() -> None:
        for i in range(count):
            output.send(POSE, ())
            sent.append(i)

    thread = threading.Thread(target=loop)
    thread.start()
    for _ in range(1000):
        if output.backlog == QUEUED_FRAMES:
            break
        thread.join(0.01)
    assert thread.is_alive()
    assert len(sent) <= QUEUED_FRAMES + 1
    assert output.backlog <= QUEUED_FRAMES
    sink.go.set()
    thread.join(10.0)
    output.close()
    assert sink.frames == count


def test_a_full_disk_is_told_once_and_again_at_the_end() -> None:
    sink, told = Sink(fails_at=3), list[str]()
    output = opened(sink, told)
    for _ in range(2 * QUEUED_FRAMES):
        output.send(POSE, ())
    with pytest.raises(OutputError, match="No space left on device"):
        output.close()
    assert len(told) == 1
    assert sink.frames == 3
    assert sink.calls[-1] == "close"


def test_a_bug_in_a_sink_is_not_hidden_and_does_not_block_the_loop() -> None:
    output = opened(Sink(fails_at=0, error=ZeroDivisionError()), [])
    for _ in range(2 * QUEUED_FRAMES):
        output.send(POSE, ())
    with pytest.raises(ZeroDivisionError):
        output.close()
