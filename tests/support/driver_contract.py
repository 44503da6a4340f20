"""The driver contract as tests: every driver's own test file runs one of these classes.

A subclass in a test file brings the fixture ``make``: a function that makes the driver, unopened,
with all its devices in sight and moving for at least five seconds.
"""

from collections.abc import Callable

import numpy as np

from lobstr_hw.drivers import DRIVERS, driver_class
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.trackers import FOUR_POINTS

__all__ = ["DriverContract", "Make", "RecordedDriverContract"]

Make = Callable[[], TrackerDriver]


class DriverContract:
    """What holds for every driver."""

    def test_it_is_in_the_table_and_probing_opens_nothing(self, make: Make) -> None:
        driver = make()
        assert type(driver) in [driver_class(name) for name in DRIVERS]
        assert type(driver).probe().available
        assert not driver.devices()
        assert not driver.poll(10.0)
        assert not driver.events()

    def test_it_gives_samples_oldest_first_and_none_newer_than_now(self, make: Make) -> None:
        with make() as driver:
            last = -np.inf
            for now in np.arange(0.0, 2.0, 1 / 45):
                times = [sample.time_s for sample in driver.poll(now)]
                assert times == sorted(times)
                assert all(last <= time_s <= now for time_s in times)
                last = max(times, default=last)
        assert last > 1.9

    def test_it_gives_no_sample_twice(self, make: Make) -> None:
        with make() as driver:
            polled = [s for now in np.arange(0.0, 1.0, 0.0173) for s in driver.poll(now)]
        given = [(sample.serial, sample.time_s) for sample in polled]
        assert len(given) == len(set(given)) > 0

    def test_asking_for_the_past_gives_nothing(self, make: Make) -> None:
        with make() as driver:
            driver.poll(1.0)
            assert not driver.poll(0.5)
            assert not driver.poll(1.0)

    def test_its_devices_are_those_of_its_samples_and_say_their_role(self, make: Make) -> None:
        with make() as driver:
            serials = {sample.serial for sample in driver.poll(1.0)}
            devices = driver.devices()
        moving = [device for device in devices if device.kind != "base_station"]
        assert {device.serial for device in moving} == serials
        assert {device.role_hint for device in moving} == set(FOUR_POINTS)

    def test_events_are_told_once(self, make: Make) -> None:
        with make() as driver:
            driver.poll(5.0)
            driver.events()
            assert not driver.events()

    def test_closing_twice_is_harmless_and_ends_the_samples(self, make: Make) -> None:
        driver = make()
        driver.open()
        driver.close()
        driver.close()
        assert not driver.poll(5.0)

    def test_opening_again_begins_again(self, make: Make) -> None:
        driver = make()
        with driver:
            first = [sample.time_s for sample in driver.poll(1.0)]
        with driver:
            again = [sample.time_s for sample in driver.poll(1.0)]
        assert first == again

    def test_closing_before_opening_is_harmless(self, make: Make) -> None:
        make().close()


class RecordedDriverContract(DriverContract):
    """What holds besides where samples have times of their own, whenever they are asked for."""

    def test_it_gives_each_sample_once_however_it_is_polled(self, make: Make) -> None:
        with make() as driver:
            at_once = driver.poll(2.0)
        with make() as driver:
            in_steps = [s for now in np.arange(0.0, 2.001, 0.0173) for s in driver.poll(now)]
            in_steps += driver.poll(2.0)
        assert len(at_once) == len(in_steps) > 0
        for a, b in zip(at_once, in_steps, strict=True):
            assert (a.serial, a.time_s, a.state) == (b.serial, b.time_s, b.state)
            assert a.T_world_tracker.p is not None
            np.testing.assert_array_equal(a.T_world_tracker.p, b.T_world_tracker.p)
            np.testing.assert_array_equal(a.T_world_tracker.R, b.T_world_tracker.R)
