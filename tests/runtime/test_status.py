import io

import pytest
from rich.console import Console
from support.poses import random_poses

from lobstr_hw.runtime.status import Snapshot, StatusLine, render
from lobstr_hw.skeleton import Body


def snapshot(frames: int, wall_s: float, total_s: float | None = 60.0) -> Snapshot:
    pose = random_poses(1, 1, Body.standard())[0]
    return Snapshot(30.0, total_s, frames, wall_s, True, 3, 0, 7, pose)


def drawn(now: Snapshot, before: Snapshot | None = None) -> str:
    console = Console(file=io.StringIO(), width=200)
    console.print(render(now, before))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_the_line_tells_rate_ages_state_and_trouble() -> None:
    text = drawn(snapshot(190, 14.0), snapshot(100, 12.0))
    for part in ("30.0/60 s", "45 Hz", "calibrated", "pelvis 10 ms", "feet", "late 3", "refused 7"):
        assert part in text
    assert "queued" not in text


def test_without_an_end_there_is_no_progress() -> None:
    assert "/60" not in drawn(snapshot(1, 0.0, None))


def test_nothing_is_drawn_where_stderr_is_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with StatusLine(lambda: snapshot(1, 1.0)):
        pass
    assert capsys.readouterr().err == ""
