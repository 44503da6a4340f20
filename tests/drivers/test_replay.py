"""Replay gives what the log holds, at the log's own times."""

from pathlib import Path

import numpy as np
import pytest

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.errors import LogFileError
from lobstr_hw.poses import PartialPose
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

START_S = 12345.678


def sample(time_s: float, tracked: bool = True, p: float = 0.0) -> TrackerSample:
    state = TrackingState.OK if tracked else TrackingState.OCCLUDED
    pose = PartialPose(np.eye(3), np.full(3, p))
    return TrackerSample("A", pose, START_S + time_s, tracked, state)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "a.mcap"


def test_times_begin_at_zero_and_keep_their_intervals(path: Path) -> None:
    times = [0.0, 0.011, 0.25, 0.251, 3.0]
    with TrackerLogWriter(path) as writer:
        writer.add_samples([sample(time_s) for time_s in times])
    with ReplayDriver(path) as driver:
        given = [s.time_s for s in driver.poll(10.0)]
        assert given == pytest.approx(times, abs=2e-9)
        assert driver.duration_s == pytest.approx(3.0)


def test_it_is_finished_when_nothing_comes_any_more(path: Path) -> None:
    with TrackerLogWriter(path) as writer:
        writer.add_samples([sample(0.0), sample(1.0)])
    driver = ReplayDriver(path)
    assert driver.finished(0.0), "nothing comes from a closed driver"
    with driver:
        assert not driver.finished(0.5)
        driver.poll(driver.duration_s)
        assert driver.finished(driver.duration_s)
        assert not driver.poll(100.0)
    assert driver.finished(0.0)


def test_a_loss_is_a_sample_that_is_not_tracked(path: Path) -> None:
    with TrackerLogWriter(path) as writer:
        writer.add_samples([sample(0.0), sample(0.1, tracked=False)])
        writer.add_state("A", None, TrackingState.GONE, False, START_S + 0.2)
    with ReplayDriver(path) as driver:
        given = [(s.tracked, s.state) for s in driver.poll(1.0)]
    assert given == [
        (True, TrackingState.OK),
        (False, TrackingState.OCCLUDED),
        (False, TrackingState.GONE),
    ]


def test_a_broken_number_reaches_the_gate_and_the_log_goes_on(path: Path) -> None:
    with TrackerLogWriter(path) as writer:
        writer.add_samples([sample(0.0), sample(0.1, p=np.nan), sample(0.2)])
    with ReplayDriver(path) as driver:
        finite = [bool(np.isfinite(s.T_world_tracker.p).all()) for s in driver.poll(1.0)]  # type: ignore[arg-type]
    assert finite == [True, False, True]


def test_buttons_and_disappearances_are_events_at_their_time(path: Path) -> None:
    ok, gone = TrackingState.OK, TrackingState.GONE
    role = TrackerRole.LEFT_HAND
    with TrackerLogWriter(path) as writer:
        writer.add_state("A", role, ok, True, START_S, 0.8)
        writer.add_sample(sample(0.0))
        writer.add_state("A", role, ok, True, START_S + 1.0, 0.8, ("trigger",))
        writer.add_state("A", role, ok, True, START_S + 2.0, 0.7, ("menu",))
        writer.add_state("A", role, gone, False, START_S + 3.0, 0.7)
        writer.add_state("A", role, ok, True, START_S + 4.0, 0.7)
        writer.add_sample(sample(4.0))
    with ReplayDriver(path) as driver:
        driver.poll(2.5)
        first = [(e.kind, e.name, round(e.time_s, 6)) for e in driver.events()]
        (device,) = driver.devices()
        driver.poll(5.0)
        rest = [(e.kind, e.name, round(e.time_s, 6)) for e in driver.events()]
    assert first == [
        (EventKind.BUTTON_DOWN, "trigger", 1.0),
        (EventKind.BUTTON_UP, "trigger", 2.0),
        (EventKind.BUTTON_DOWN, "menu", 2.0),
    ]
    assert rest == [
        (EventKind.GONE, "", 3.0),
        (EventKind.BUTTON_UP, "menu", 3.0),
        (EventKind.BACK, "", 4.0),
    ]
    assert (device.kind, device.role_hint, device.battery) == ("controller", role, 0.7)


def test_a_new_play_space_and_commands_come_again_in_their_order(path: Path) -> None:
    happened = [
        DeviceEvent(EventKind.RECENTRED, "", START_S - 0.5),
        DeviceEvent(EventKind.COMMAND, "", START_S + 1.0, "freeze"),
        DeviceEvent(EventKind.BUTTON_DOWN, "A", START_S + 1.5, "trigger"),
        DeviceEvent(EventKind.RECENTRED, "", START_S + 2.0),
    ]
    with TrackerLogWriter(path) as writer:
        writer.add_sample(sample(0.0))
        for event in happened:
            writer.add_event(event)
        writer.add_event(DeviceEvent(EventKind.NOTICE, "", START_S + 2.1, "a station was moved"))
        writer.add_sample(sample(4.0))
    with ReplayDriver(path) as driver:
        driver.poll(1.9)
        first = driver.events()
        driver.poll(5.0)
        rest = driver.events()
        assert driver.duration_s == pytest.approx(4.0)
    assert [(e.kind, e.name) for e in (*first, *rest)] == [(e.kind, e.name) for e in happened]
    assert [e.time_s for e in first] == pytest.approx([-0.5, 1.0, 1.5])
    assert [e.time_s for e in rest] == pytest.approx([2.0])


def test_a_cut_log_is_replayed_up_to_the_cut(path: Path) -> None:
    writer = TrackerLogWriter(path)
    with FakeDriver() as fake:
        writer.add_samples(fake.poll(2.0))
    content = path.read_bytes()
    writer.close()
    path.write_bytes(content[: len(content) // 2])
    with ReplayDriver(path) as driver:
        assert driver.log.cut
        assert 0.9 < driver.duration_s < 1.1
        assert len(driver.poll(10.0)) == sum(len(track) for track in driver.log.trackers)


def test_a_missing_log_is_told_on_opening_and_not_before(tmp_path: Path) -> None:
    driver = ReplayDriver(tmp_path / "none.mcap")
    with pytest.raises(LogFileError, match="Give the path"):
        driver.open()
    driver.close()
