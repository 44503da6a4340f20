"""Times, losses, buttons: what streaming drivers share, on a clock in the test's hands."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lobstr_hw.drivers import stream
from lobstr_hw.drivers.device_clock import DeviceClock
from lobstr_hw.drivers.driver import DeviceInfo, EventKind
from lobstr_hw.drivers.reading_thread import (
    QUEUE_LENGTH,
    Arrival,
    Command,
    LinkLost,
    Lost,
    Notice,
    Reading,
    ReadingThread,
    Recentred,
    Source,
)
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.poses import PartialPose
from lobstr_hw.trackers import TrackerSample, TrackingState

PERF_S = 5000.0
"""What perf_counter says at time 0 of the session: nothing to do with it."""


class HandFed:
    """Stands for the reading thread."""

    def __init__(self, _connect: Callable[[], Source]) -> None:
        self.arrivals: list[tuple[float, Arrival]] = []

    def take(self) -> list[tuple[float, Arrival]]:
        taken, self.arrivals = self.arrivals, []
        return taken

    def close(self) -> None:
        self.arrivals = []


class Bench(StreamDriver):
    """A driver whose arrivals and clock the test sets."""

    perf_s = PERF_S

    def _info(self, serial: str) -> DeviceInfo:
        return DeviceInfo(serial, "tracker", "bench")

    def hear(self, at_s: float, what: Arrival) -> None:
        assert isinstance(self._thread, HandFed)
        self._thread.arrivals.append((PERF_S + at_s, what))

    def at(self, now_s: float) -> Sequence[TrackerSample]:
        """Poll at the nominal time."""
        self.perf_s = PERF_S + now_s
        return self.poll(now_s)

    def tick(self, now_s: float, late_s: float = 0.0) -> list[float]:
        """Poll at the nominal time, so much too late; the samples' times."""
        self.perf_s = PERF_S + now_s + late_s
        return [sample.time_s for sample in self.poll(now_s)]


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    driver = Bench()
    monkeypatch.setattr(stream, "ReadingThread", HandFed)
    monkeypatch.setattr(stream, "perf_counter", lambda: driver.perf_s)
    driver.open()
    return driver


def reading(
    device_s: float | None = None, serial: str = "A", buttons: frozenset[str] | None = None
) -> Reading:
    pose = PartialPose(np.eye(3), np.zeros(3))
    return Reading(serial, pose, TrackingState.OK, device_s, buttons)


@given(
    st.floats(-1e4, 1e4),
    st.lists(st.floats(0.0, 0.3), min_size=2, max_size=60),
    st.floats(-5e-5, 5e-5),
)
def test_late_packets_and_drift_move_no_devices_time(
    offset_s: float, delays_s: list[float], drift: float
) -> None:
    delays_s[0] = 0.0
    clock = DeviceClock()
    for i, delay_s in enumerate(delays_s):
        device_s = i / 60.0
        measured_s = offset_s + device_s * (1.0 + drift)
        clock.observe(device_s, measured_s + delay_s)
        assert clock.host_s(device_s) == pytest.approx(measured_s, abs=1e-3)


def test_the_offset_is_followed_for_hours() -> None:
    clock = DeviceClock()
    for i in range(3600 * 10):
        device_s = i / 10.0
        clock.observe(device_s, device_s * (1.0 + 5e-5) + (0.02 if i % 7 else 0.0))
        assert clock.host_s(device_s) == pytest.approx(device_s * (1.0 + 5e-5), abs=1e-3)


def test_a_device_that_was_switched_off_and_on_begins_anew() -> None:
    clock = DeviceClock()
    clock.observe(1000.0, 5.0)
    clock.observe(0.0, 6.0)
    assert clock.host_s(0.0) == pytest.approx(6.0)


def test_a_late_tick_neither_moves_a_sample_nor_gives_one_of_the_future(bench: Bench) -> None:
    bench.tick(1.0)
    for at_s in (1.009, 1.019, 1.029):
        bench.hear(at_s, reading())
    assert bench.tick(1.02, late_s=0.01) == pytest.approx([1.009, 1.019])
    assert bench.tick(1.04) == pytest.approx([1.029])


def test_with_a_device_clock_neither_late_ticks_nor_late_packets_count(bench: Bench) -> None:
    bench.tick(1.0)
    random = np.random.default_rng(5)
    times: list[float] = []
    for k in range(1, 200):
        measured_s = 1.0 + 0.01 * k
        bench.hear(measured_s + random.choice([0.0, 0.002, 0.008]), reading(77.0 + 0.01 * k))
        times += bench.tick(measured_s + 0.009, late_s=random.choice([0.0, 0.001]))
    np.testing.assert_allclose(np.diff(times)[20:], 0.01, atol=1e-9)


def test_times_never_go_back_while_the_clocks_offset_is_being_found(bench: Bench) -> None:
    bench.tick(1.0)
    times: list[float] = []
    for k, delay_s in enumerate([0.2, 0.1, 0.0, 0.05]):
        bench.hear(1.3 + 0.01 * k + delay_s, reading(0.01 * k))
        times += bench.tick(1.6 + 0.01 * k)
    assert len(times) == 4
    assert times == sorted(times)


def test_silence_is_a_loss_told_once_and_a_word_is_a_return(bench: Bench) -> None:
    bench.tick(1.0)
    bench.hear(1.05, reading(buttons=frozenset({"trigger"})))
    bench.hear(1.05, reading(serial="B"))
    bench.tick(1.1)
    bench.events()
    bench.hear(2.0, reading(serial="B"))
    assert len(bench.tick(2.0)) == 1
    assert bench.tick(2.1) == pytest.approx([2.1])
    assert bench.tick(2.2) == []
    told = [(e.kind, e.serial, e.name) for e in bench.events()]
    assert told == [(EventKind.GONE, "A", ""), (EventKind.BUTTON_UP, "A", "trigger")]
    bench.hear(2.25, reading())
    assert bench.tick(2.3) == pytest.approx([2.25])
    assert [(e.kind, e.serial) for e in bench.events()] == [(EventKind.BACK, "A")]


def test_a_lost_device_loses_all_a_lost_tracker_only_itself(bench: Bench) -> None:
    bench.tick(1.0)
    for serial in "AB":
        bench.hear(1.01, reading(serial=serial))
    bench.hear(1.02, Lost("A"))
    bench.hear(1.03, Lost())
    bench.hear(1.04, Lost("nobody"))
    bench.tick(1.1)
    gone = [(e.serial, e.time_s) for e in bench.events() if e.kind is EventKind.GONE]
    assert [serial for serial, _ in gone] == ["A", "B"]
    assert [time_s for _, time_s in gone] == pytest.approx([1.02, 1.03])


def test_commands_come_at_their_time(bench: Bench) -> None:
    bench.tick(1.0)
    bench.hear(1.02, Command("calibrate"))
    bench.tick(1.01, late_s=0.02)
    assert not bench.events(), "it is of the next tick"
    bench.tick(1.03)
    (event,) = bench.events()
    assert (event.kind, event.name) == (EventKind.COMMAND, "calibrate")
    assert event.time_s == pytest.approx(1.02)


class Falling(StreamDriver):
    """Loses its device while it is set up."""

    def _connect(self) -> Source:
        raise LinkLost("pulled")


def test_a_device_that_goes_while_it_is_set_up_is_an_error_of_opening() -> None:
    with pytest.raises(TrackerNotFound, match="went while it was set up"):
        Falling().open()


class Flood:
    """Sends without end, as fast as it is read."""

    def __init__(self) -> None:
        self.reads = 0

    def read(self) -> list[Reading]:
        self.reads += 1
        return [reading(float(self.reads * 100 + i)) for i in range(100)]

    def close(self) -> None:
        pass


def test_a_queue_that_nobody_empties_drops_its_oldest() -> None:
    source = Flood()
    thread = ReadingThread(lambda: source)
    while source.reads < 50:
        pass
    thread.close()
    times = [what.device_s for _, what in thread.take() if isinstance(what, Reading)]
    assert len(times) == QUEUE_LENGTH - 1  # and the Lost of closing
    assert times[-1] == source.reads * 100 + 99
    np.testing.assert_array_equal(np.diff(np.array(times, dtype=float)), 1.0)


def test_every_clock_is_mapped_by_itself_and_samples_are_sorted_by_time(bench: Bench) -> None:
    told = [replace(reading(t, serial), clock=serial) for t, serial in ((5.0, "A"), (900.0, "B"))]
    bench.hear(0.1, told[0])
    bench.hear(0.1, told[1])
    bench.hear(0.2, replace(told[0], device_s=5.1))
    bench.hear(0.21, replace(told[1], device_s=900.05))
    samples = bench.at(1.0)
    assert [s.serial for s in samples] == ["A", "B", "B", "A"]
    np.testing.assert_allclose([s.time_s for s in samples], [0.1, 0.1, 0.15, 0.2], atol=1e-9)


def test_a_slow_tracker_keeps_its_times_beside_a_quick_one(bench: Bench) -> None:
    bench.hear(0.10, replace(reading(1.0, "slow"), clock="slow"))
    bench.hear(0.30, replace(reading(1.0, "quick"), clock="quick"))
    bench.at(0.31)
    bench.hear(0.32, replace(reading(1.1, "slow"), clock="slow"))
    [late] = bench.at(0.4)
    assert late.time_s == pytest.approx(0.2), "its own time, though older than what was given"


@given(st.lists(st.floats(0.0, 0.5), max_size=8))
def test_a_button_without_a_pose_moves_no_sample(presses: list[float]) -> None:
    """Poses of 12 ms come at once, a button when it is pressed."""

    def times(pressed: list[float]) -> tuple[list[float], list[float]]:
        with pytest.MonkeyPatch.context() as patched:
            driver = Bench()
            patched.setattr(stream, "ReadingThread", HandFed)
            patched.setattr(stream, "perf_counter", lambda: driver.perf_s)
            driver.open()
            heard = [(0.012 * (k // 3 + 1), reading(7.0 + 0.004 * k)) for k in range(120)]
            heard += [(t, replace(reading(buttons=frozenset({str(n)})), T_world_tracker=None))
                      for n, t in enumerate(sorted(pressed))]  # fmt: skip
            for at_s, what in sorted(heard, key=lambda pair: pair[0]):
                driver.hear(at_s, what)
            given = [s.time_s for k in range(60) for s in driver.at(k / 90)]
            return given, [event.time_s for event in driver.events()]

    told, events = times(presses)
    assert told == times([])[0]
    assert events == sorted(events)
    assert len(events) == max(0, 2 * len(presses) - 1)


def test_words_for_the_user_and_a_moved_origin_are_events(bench: Bench) -> None:
    bench.hear(0.1, Notice("a base station was moved"))
    bench.hear(0.2, Recentred())
    assert not bench.at(1.0)
    kinds = [(event.kind, event.name) for event in bench.events()]
    assert kinds == [(EventKind.NOTICE, "a base station was moved"), (EventKind.RECENTRED, "")]


def test_velocity_and_covariance_are_handed_on(bench: Bench) -> None:
    v, P = np.arange(3.0), np.eye(6)
    bench.hear(0.1, replace(reading(), velocity=v, covariance=P))
    [sample] = bench.at(1.0)
    assert sample.velocity is v
    assert sample.covariance is P
