"""The driver contract for devices that send on their own, run behind the real vendor library.

A test file gives its device a bed and inherits the class:

    class TestContract(StreamDriverContract):
        @pytest.fixture
        def bed(self, tmp_path): ...
"""

import threading
import time
from contextlib import closing
from typing import Protocol

import numpy as np
import pytest
from numpy.typing import NDArray
from support.waiting import wait_until

from lobstr_hw.drivers import DRIVERS, driver_class, reading_thread, serial_stream, stream
from lobstr_hw.drivers.driver import BASE_STATION, EventKind, TrackerDriver
from lobstr_hw.drivers.stream import StreamDriver
from lobstr_hw.trackers import TrackerSample, TrackingState

__all__ = ["Sent", "StreamBed", "StreamDriverContract", "gather"]

Sent = tuple[str, float, NDArray[np.float64]]
"""Serial, device time, position in our world: what a sample must say."""

POLL_S = 0.02
"""More than a poll may take on a busy machine, and less than any wait for a device."""


class StreamBed(Protocol):
    """A device whose sending is in the hands of the test."""

    serials: frozenset[str]
    has_clock: bool
    on_opening: int
    """Samples that the device sends by itself once it is set going."""
    has_line: bool
    """Losing the device shows at once; without, only by its silence."""

    def make(self) -> TrackerDriver: ...
    def send(self, frames: int) -> list[Sent]: ...
    def cut(self) -> None: ...
    def restore(self) -> None: ...


def gather(driver: TrackerDriver, now_s: float, count: int) -> list[TrackerSample]:
    """Poll at ``now_s`` and on as time goes by, until so many samples are there."""
    samples: list[TrackerSample] = []
    begin = time.perf_counter()

    def arrived() -> bool:
        polled_s = now_s + time.perf_counter() - begin
        new = driver.poll(polled_s)
        assert all(sample.time_s <= polled_s for sample in new)
        samples.extend(new)
        return len(samples) >= count

    wait_until(arrived, f"{count} samples by {now_s} s")
    return samples


def all_arrived(driver: TrackerDriver, count: int) -> None:
    """Wait until the reading thread has so many, without polling."""
    assert isinstance(driver, StreamDriver)
    thread = driver._thread
    assert thread is not None
    wait_until(lambda: len(thread._arrivals) >= count, f"{count} arrivals")


class StreamDriverContract:
    """What the runtime rests on."""

    @pytest.fixture
    def bed(self) -> StreamBed:
        raise NotImplementedError

    @pytest.fixture(autouse=True)
    def eager(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Look for a lost device at once, and wait for no line."""
        monkeypatch.setattr(reading_thread, "RETRY_S", 0.01)
        monkeypatch.setattr(serial_stream, "READ_S", 0.01)

    def opened(self, bed: StreamBed) -> TrackerDriver:
        """Open, with what the device sent on its own out of the way."""
        driver = bed.make()
        driver.open()
        if bed.on_opening:
            gather(driver, 1.0, bed.on_opening)
        return driver

    def test_it_is_in_the_table_and_probing_opens_nothing(self, bed: StreamBed) -> None:
        driver = bed.make()
        assert type(driver) in [driver_class(name) for name in DRIVERS]
        assert type(driver).probe().available
        assert not driver.devices()
        assert not driver.poll(10.0)
        assert not driver.events()

    def test_every_sample_comes_once_in_order_and_none_is_newer_than_now(
        self, bed: StreamBed
    ) -> None:
        with closing(self.opened(bed)) as driver:
            last_s = 0.0
            for now_s in (1.5, 1.6, 1.9, 2.5):
                sent = bed.send(4)
                samples = gather(driver, now_s, len(sent))
                assert [s.serial for s in samples] == [serial for serial, _, _ in sent]
                for sample, (_, _, p) in zip(samples, sent, strict=True):
                    assert sample.tracked
                    assert last_s <= sample.time_s
                    assert sample.T_world_tracker.p is not None
                    np.testing.assert_allclose(sample.T_world_tracker.p, p, atol=2e-3)
                    last_s = sample.time_s

    def test_intervals_are_the_devices_own_where_it_has_a_clock(self, bed: StreamBed) -> None:
        with closing(self.opened(bed)) as driver:
            sent = bed.send(1)
            gather(driver, 1.5, len(sent))
            sent = bed.send(6)
            all_arrived(driver, len(sent))  # or the offset of the clocks changes on the way
            samples = gather(driver, 2.0, len(sent))
        if bed.has_clock:
            intervals = np.diff([s.time_s for s in samples])
            np.testing.assert_allclose(intervals, np.diff([t for _, t, _ in sent]), atol=1e-3)
        else:
            assert all(s.time_s > 1.5 for s in samples), "stamped when it arrived"

    def test_polling_never_waits_for_the_device(self, bed: StreamBed) -> None:
        with closing(self.opened(bed)) as driver:
            begin = time.perf_counter()
            for step in range(50):
                assert not driver.poll(1.5 + 1e-3 * step)
            assert time.perf_counter() - begin < 50 * POLL_S

    def test_asking_for_the_past_gives_nothing(self, bed: StreamBed) -> None:
        with closing(self.opened(bed)) as driver:
            driver.poll(1.8)
            sent = bed.send(1)
            assert not driver.poll(1.5)
            assert not driver.poll(1.8)
            assert len(gather(driver, 1.9, len(sent))) == len(sent), "nothing was lost by it"

    def test_its_devices_are_those_of_its_samples(self, bed: StreamBed) -> None:
        with closing(self.opened(bed)) as driver:
            sent = bed.send(2)
            samples = gather(driver, 1.5, len(sent))
            devices = driver.devices()
        moving = {d.serial for d in devices if d.kind != BASE_STATION}
        assert {s.serial for s in samples} == moving == bed.serials
        assert all(device.kind and device.model for device in devices)

    def test_a_lost_device_is_one_sample_and_one_event_and_comes_back(
        self, bed: StreamBed, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        if not bed.has_line:
            monkeypatch.setattr(stream, "SILENCE_S", 0.1)
        with closing(self.opened(bed)) as driver:
            gather(driver, 1.5, len(bed.send(2)))
            driver.events()
            bed.cut()
            now_s = 2.0
            samples = gather(driver, now_s, len(bed.serials))
            assert {s.serial for s in samples} == bed.serials
            assert {(s.state, s.tracked) for s in samples} == {(TrackingState.GONE, False)}
            assert not driver.poll(now_s + 3.0), "told once"
            events = driver.events()
            assert {e.serial for e in events if e.kind is EventKind.GONE} == bed.serials
            assert len(events) == len(bed.serials)
            bed.restore()
            self.returns(bed, driver, now_s + 4.0)

    def returns(self, bed: StreamBed, driver: TrackerDriver, now_s: float) -> None:
        """The device is found again without anybody's help."""
        seen: set[str] = set()
        begin = time.perf_counter()

        def back() -> bool:
            bed.send(1)
            polled_s = now_s + time.perf_counter() - begin
            seen.update(s.serial for s in driver.poll(polled_s) if s.tracked)
            return seen == bed.serials

        wait_until(back, "every tracker is back")
        back_again = {e.serial for e in driver.events() if e.kind is EventKind.BACK}
        assert back_again == bed.serials

    def test_closing_twice_is_harmless_and_leaves_nothing_behind(self, bed: StreamBed) -> None:
        driver = self.opened(bed)
        bed.send(2)
        driver.close()
        driver.close()
        assert not driver.poll(5.0)
        assert not driver.devices()
        assert not [t for t in threading.enumerate() if t.name == "lobstr-driver"]

    def test_opening_again_begins_again(self, bed: StreamBed) -> None:
        driver = bed.make()
        for _ in range(2):
            with driver:
                if bed.on_opening:
                    gather(driver, 1.0, bed.on_opening)
                sent = bed.send(2)
                assert len(gather(driver, 1.5, len(sent))) == len(sent)

    def test_closing_before_opening_is_harmless(self, bed: StreamBed) -> None:
        bed.make().close()
