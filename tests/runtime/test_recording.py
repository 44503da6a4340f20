import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from support.fake_clock import FakeClock
from support.list_driver import ListDriver

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter, read_log
from lobstr_hw.poses import PartialPose
from lobstr_hw.runtime.recording import Recorder
from lobstr_hw.runtime.recording_status import (
    RecordingSnapshot,
    TrackerLine,
    render_recording,
    size,
)
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample, TrackingState


def recorder(driver: ListDriver | FakeDriver, path: Path, clock: FakeClock) -> Recorder:
    table = RoleTable(None, driver.devices)
    return Recorder(driver, TrackerLogWriter(path), table, clock, 90.0)


def sample(time_s: float, tracked: bool = True, serial: str = "A") -> TrackerSample:
    return TrackerSample(serial, PartialPose(np.eye(3), np.zeros(3)), time_s, tracked)


class PressedDriver(ListDriver):
    """Somebody presses a trigger, and a battery runs down."""

    battery = 0.9
    happened: tuple[DeviceEvent, ...] = ()

    def devices(self) -> list[DeviceInfo]:
        return [replace(device, battery=self.battery) for device in super().devices()]

    def events(self) -> tuple[DeviceEvent, ...]:
        events, self.happened = self.happened, ()
        return events


def test_a_recording_holds_exactly_what_the_driver_gave(tmp_path: Path) -> None:
    clock = FakeClock(0.0)
    with FakeDriver() as driver:
        recording = recorder(driver, tmp_path / "a.mcap", clock)
        recording.run(lambda: False, 2.0)
        recording._writer.close()
    with FakeDriver() as driver:
        given = driver.poll(2.0)
    log = read_log(tmp_path / "a.mcap")
    kept = list(log.samples())
    assert not log.cut
    assert [s.serial for s in kept] == [s.serial for s in given]
    # logs round times down to whole nanoseconds
    np.testing.assert_allclose([s.time_s for s in kept], [s.time_s for s in given], atol=1.1e-9)
    for a, b in zip(kept, given, strict=True):
        np.testing.assert_allclose(a.T_world_tracker.R, b.T_world_tracker.R, atol=1e-6)
    assert {track.role for track in log.trackers} == set(FOUR_POINTS)
    assert log.unix_offset_s == pytest.approx(1.7e9)


def test_after_every_poll_all_of_it_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with FakeDriver() as driver:
        recording = recorder(driver, path, FakeClock(0.0))
        for now_s in (0.0, 0.3, 0.31, 0.5):
            recording.step(now_s)
            last_s = read_log(path).duration_s
            assert now_s - last_s < 1.0 / 90.0 + 1e-6
        recording._writer.abandon()


def test_late_polls_are_counted_and_not_made_up(tmp_path: Path) -> None:
    class Slow(FakeDriver):
        polls = 0

        def poll(self, now_s: float) -> list[TrackerSample]:
            self.polls += 1
            clock.advance(0.105 if self.polls == 3 else 0.001)
            return list(super().poll(now_s))

    clock = FakeClock()
    with Slow() as driver:
        recording = recorder(driver, tmp_path / "a.mcap", clock)
        recording.run(lambda: driver.polls == 20)
        recording._writer.abandon()
    assert recording.late == 8
    assert clock.now_s() - 100.0 == pytest.approx((20 + 8) / 90.0)


def test_dropouts_are_times_without_sight_or_without_samples(tmp_path: Path) -> None:
    seen = [(k * 0.01, not 20 <= k < 30) for k in range(50)]
    gap = [(1.0 + k * 0.01, True) for k in range(10)]
    driver = ListDriver([sample(*item) for item in seen + gap], {"A": None})
    recording = recorder(driver, tmp_path / "a.mcap", FakeClock(0.0))
    recording.run(lambda: False, 2.0)
    recording._writer.close()
    tally = recording.trackers["A"]
    assert tally.samples == 60
    assert tally.dropouts == 2
    assert tally.lost_s == pytest.approx(0.1 + 0.51)


def test_buttons_and_batteries_are_states_from_their_time_on(tmp_path: Path) -> None:
    driver = PressedDriver([sample(k * 0.1) for k in range(30)], {"A": TrackerRole.LEFT_HAND})
    recording = recorder(driver, tmp_path / "a.mcap", FakeClock(0.0))
    recording.step(0.05)
    driver.happened = (DeviceEvent(EventKind.BUTTON_DOWN, "A", 0.42, "trigger"),)
    recording.step(0.5)
    driver.happened = (DeviceEvent(EventKind.BUTTON_UP, "A", 0.71, "trigger"),)
    recording.step(0.8)
    driver.battery = 0.1
    recording.step(2.0)
    recording._writer.close()
    track = read_log(tmp_path / "a.mcap").tracker("A")
    assert track.role is TrackerRole.LEFT_HAND
    assert track.device_at(0.3).buttons == ()
    assert track.device_at(0.5).buttons == ("trigger",)
    assert track.device_at(0.8).buttons == ()
    assert track.device_at(0.8).battery == 0.9
    assert track.device_at(2.0).battery == 0.1


def test_a_new_play_space_and_commands_are_recorded(tmp_path: Path) -> None:
    driver = PressedDriver([sample(k * 0.1) for k in range(30)], {"A": TrackerRole.LEFT_HAND})
    recording = recorder(driver, tmp_path / "a.mcap", FakeClock(0.0))
    recording.step(0.45)
    happened = (
        DeviceEvent(EventKind.RECENTRED, "", 0.5),
        DeviceEvent(EventKind.COMMAND, "", 0.6, "freeze"),
    )
    driver.happened = happened
    recording.step(2.0)
    recording._writer.close()
    assert read_log(tmp_path / "a.mcap").events == happened


def test_a_tracker_that_goes_is_recorded_as_gone(tmp_path: Path) -> None:
    gone = replace(sample(0.5, tracked=False), state=TrackingState.GONE)
    driver = ListDriver([sample(0.0), sample(0.4), gone], {"A": None})
    recording = recorder(driver, tmp_path / "a.mcap", FakeClock(0.0))
    recording.step(1.0)
    recording._writer.close()
    assert read_log(tmp_path / "a.mcap").tracker("A").device_at(0.6).state is TrackingState.GONE


def drawn(now: RecordingSnapshot, before: RecordingSnapshot | None = None) -> str:
    console = Console(file=io.StringIO(), width=200)
    console.print(render_recording(now, before))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_the_lines_tell_rates_dropouts_and_the_disk() -> None:
    lines = (
        TrackerLine("LHR-1", TrackerRole.LEFT_HAND, 90, 0, True),
        TrackerLine("LHR-2", None, 90, 3, False),
    )
    before = RecordingSnapshot(10.0, 10.0, 100_000, 10**9, 0, lines)
    later = tuple(replace(line, samples=line.samples + 45) for line in lines)
    now = RecordingSnapshot(10.5, 10.5, 105_000, 10**9, 2, later)
    text = drawn(now, before)
    for part in ("10.5 s", "105 kB", "free 1.0 GB", "full in 27 h", "left hand", "90 Hz"):
        assert part in text
    for part in ("no role", "lost", "drop-outs 3", "late 2"):
        assert part in text
    assert "no samples yet" in drawn(replace(now, trackers=()))


@pytest.mark.parametrize(
    ("count", "text"), [(12, "12 B"), (999_600, "1 MB"), (2_340_000, "2.34 MB"), (5e9, "5.0 GB")]
)
def test_sizes_are_read_by_people(count: float, text: str) -> None:
    assert size(count) == text
