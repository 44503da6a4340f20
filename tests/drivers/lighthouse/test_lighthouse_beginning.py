"""Samples and light overtake each other, and old reports come first: nothing else comes out."""

import struct

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.lighthouse_room import carried, device, room
from support.lighthouse_wire import TimedReport, reports_of

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S
from lobstr_hw.drivers.lighthouse.beginning import MOST_HELD, Beginning
from lobstr_hw.drivers.lighthouse.device_reader import DeviceReader
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.reports import PulseReport
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice

REPORTS = reports_of(room(2), device(), carried(11), 0.8, seed=11)
FIELDS = ("imu", "pulses", "syncs", "sweeps", "syncs_before")


def overtaking(reports: list[TimedReport], within_s: float, seed: int) -> list[TimedReport]:
    """As they came, each up to so much later; those of one interface keep their order."""
    random = np.random.default_rng(seed)
    last: dict[int, float] = {}
    always = random.uniform(0.0, within_s, size=2)
    due = []
    for report in reports:
        late = random.choice([always[report.interface], random.uniform(0.0, within_s)])
        came = max(report.ticks + late * TICKS_PER_S, last.get(report.interface, 0.0))
        last[report.interface] = came
        due.append(came)
    return [reports[k] for k in np.argsort(due, kind="stable")]


def heard(reports: list[TimedReport]) -> RawEvents:
    reader = DeviceReader(old_radio=False, gen2_light=False)
    for report in reports:
        reader.feed(report.data)
    return reader.take()


def followed(reports: list[TimedReport]) -> TimedPoses:
    found = TrackedDevice(device(), room(2))
    for report in reports:
        found.feed(report.data)
    return found.poses()


def left_over(ticks: int, sequence: int) -> list[TimedReport]:
    """What a device said when somebody else read it; it has lain in a buffer since."""
    slot = struct.pack("<6hIB", *(1, 2, 3, 4, 5, 6), ticks % 2**32, sequence % 256)
    words = b"".join(
        b"\x31" + struct.pack("<I", (ticks + k) % 2**24 << 3 | 2 | k << 27) for k in range(4)
    )
    first = REPORTS[0].ticks
    return [
        TimedReport(first, 0, b"\x20" + 3 * slot),
        TimedReport(first, 1, bytes([0x28, len(words)]) + words.ljust(62, b"\0")),
    ]


def assert_same(a: RawEvents, b: RawEvents) -> None:
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@pytest.mark.parametrize("seed", range(8))
def test_which_interface_is_ahead_changes_no_event(seed: int) -> None:
    expected = heard(REPORTS)
    assert len(expected.sweeps) > 1_000
    assert_same(heard(overtaking(REPORTS, 0.02, seed)), expected)


@pytest.mark.parametrize("seed", range(3))
def test_which_interface_is_ahead_changes_no_pose(seed: int) -> None:
    expected, found = followed(REPORTS), followed(overtaking(REPORTS, 0.008, seed))
    assert expected.tracked.sum() > 100
    for name in ("ticks", "p", "R", "velocity", "fix"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


@pytest.mark.parametrize("age_s", [0.5, 7.3, 60.0])
@pytest.mark.parametrize("seed", range(3))
def test_left_over_light_is_left_out_whichever_interface_is_ahead(age_s: float, seed: int) -> None:
    begin = REPORTS[0].ticks
    old = left_over(begin - int(age_s * TICKS_PER_S), sequence=-5)
    found = heard(overtaking([*old, *REPORTS], 0.02, seed))
    expected = heard([*old, *REPORTS])
    assert_same(found, expected)
    fresh = heard(REPORTS)
    later = expected.imu[-1, 0] - fresh.imu[-1, 0]  # a clock that wrapped in between
    assert len(expected.sweeps) > 500
    assert np.isin(expected.sweeps[:, 2] - later, fresh.sweeps[:, 2]).all()


def test_light_without_samples_fills_no_memory() -> None:
    beginning = Beginning()
    for k in range(10 * MOST_HELD):
        beginning.hold(PulseReport(((0, k, 100),)))
    held = beginning.release()
    assert len(held) == MOST_HELD
    assert held[-1] == PulseReport(((0, 10 * MOST_HELD - 1, 100),))
    assert beginning.release() == []
