"""The fake person's plays: smooth, the same however they are polled, buttons in order."""

import numpy as np
import pytest

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.fake import SERIALS, FakeDriver
from lobstr_hw.drivers.fake_script import SCRIPTS
from lobstr_hw.trackers import TrackerRole


def played(name: str, step_s: float, end_s: float = 24.0) -> tuple[list[float], list[DeviceEvent]]:
    heights: list[float] = []
    events: list[DeviceEvent] = []
    with FakeDriver(script=name) as driver:
        for k in range(1, round(end_s / step_s) + 1):
            samples = driver.poll(k * step_s)
            heights += [float(s.T_world_tracker.p[1]) for s in samples]  # type: ignore[index]
            events += driver.events()
    return heights, events


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_play_is_the_same_however_it_is_polled(name: str) -> None:
    often, seldom = played(name, 0.1), played(name, 0.8)
    np.testing.assert_array_equal(often[0], seldom[0])
    assert often[1] == seldom[1]


@pytest.mark.parametrize("name", SCRIPTS)
def test_nobody_moves_faster_than_people_do(name: str) -> None:
    with FakeDriver(script=name) as driver:
        samples = driver.poll(24.0)
    for serial in SERIALS.values():
        p = np.array([s.T_world_tracker.p for s in samples if s.serial == serial])
        speed = np.linalg.norm(np.diff(p, axis=0), axis=-1) * 90.0
        assert speed.max() < 4.0, serial


@pytest.mark.parametrize("name", SCRIPTS)
def test_every_button_that_goes_down_comes_up(name: str) -> None:
    held: set[tuple[str, str]] = set()
    _, events = played(name, 0.1)
    assert events
    for event in events:
        key = event.serial, event.name
        assert (event.kind is EventKind.BUTTON_DOWN) == (key not in held)
        held ^= {key}
    assert not held


def test_nameless_devices_say_nothing_of_roles() -> None:
    with FakeDriver(named=0) as driver:
        assert {device.role_hint for device in driver.devices()} == {None}
        assert {device.kind for device in driver.devices()} == {"tracker"}


def test_an_unknown_play_is_told_with_those_there_are() -> None:
    with pytest.raises(ValueError, match="calibrate"):
        FakeDriver(script="hamlet")


def test_the_plain_person_presses_nothing() -> None:
    with FakeDriver() as driver:
        driver.poll(5.0)
        assert not driver.events()
        assert TrackerRole.HEAD in {device.role_hint for device in driver.devices()}
