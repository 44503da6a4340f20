"""Flock of Birds: its bytes, and the driver behind the real pyserial."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.fake_flock import (
    FakeFlock,
    flock_record,
    transmitter_position,
    transmitter_quat,
)
from support.serial_bed import need_serial
from support.stream_contract import Sent, StreamDriverContract, gather

from lobstr_hw.drivers import flock, load_driver, record_source
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.flock import FlockDriver
from lobstr_hw.drivers.flock_records import (
    birds_with_sensor,
    parse_grouped,
    parse_single,
    setup_commands,
)
from lobstr_hw.drivers.magnetic import source_axes
from lobstr_hw.drivers.serial_stream import cut_records
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.rotations import geodesic_angle

STEP = 4 / 32768
"""The device's 14 bits."""
frames = st.integers(0, 100)


@given(st.integers(1, 14), frames)
def test_a_record_says_what_was_put_in_to_14_bits(address: int, frame: int) -> None:
    p, quat = transmitter_position(address % 4, frame), transmitter_quat(address, frame)
    data = flock_record(p, quat)
    record = parse_grouped(data + bytes([address]))
    assert record is not None
    assert record.address == address
    np.testing.assert_allclose(record.p, p / 36.0, atol=STEP)
    np.testing.assert_allclose(record.quat_wxyz, quat, atol=STEP)
    alone = parse_single(data)
    assert alone is not None
    np.testing.assert_array_equal(alone.p, record.p)


def test_the_bytes_of_one_record_as_the_manual_has_them() -> None:
    # half the range, minus the full range, 0; w = 1 less one step of 14 bits
    data = bytes([0x80, 0x20, 0x00, 0x40, 0x00, 0x00, 0x7F, 0x3F, 0, 0, 0, 0, 0, 0])
    record = parse_single(data)
    assert record is not None
    np.testing.assert_allclose(record.p, [0.5, -1.0, 0.0])
    np.testing.assert_allclose(record.quat_wxyz, [1.0 - STEP, 0.0, 0.0, 0.0])


@given(st.binary(min_size=15, max_size=15))
def test_any_bytes_are_a_believable_record_or_none(data: bytes) -> None:
    for record in (parse_single(data[:14]), parse_grouped(data)):
        if record is not None:
            assert 1 <= record.address <= 14
            assert np.linalg.norm(record.quat_wxyz) == pytest.approx(1.0, abs=0.02)
            assert np.abs(record.p).max() <= 1.0


@given(st.integers(0, 5 * 15 - 1))
def test_after_a_lost_byte_only_the_record_it_was_in_is_missing(lost: int) -> None:
    stream = b"".join(
        flock_record(transmitter_position(1, f), transmitter_quat(1, f)) + b"\1" for f in range(6)
    )
    records, rest = cut_records(stream[:lost] + stream[lost + 1 :], 15, parse_grouped)
    expected = [transmitter_position(1, f) / 36.0 for f in range(6) if f != lost // 15]
    np.testing.assert_allclose([r.p for r in records], expected, atol=STEP)
    assert rest == b""


@given(st.binary(max_size=40))
def test_strange_bytes_hide_no_later_record(strange: bytes) -> None:
    record = flock_record(transmitter_position(1, 0), transmitter_quat(1, 0))
    found, _ = cut_records(bytes(b & 0x7F for b in strange) + record * 3, 14, parse_single)
    assert len(found) == 3


def test_birds_that_are_off_or_have_no_sensor_are_left_alone() -> None:
    assert birds_with_sensor(bytes([0xC0, 0xE0, 0x20, 0xA0, 0x00])) == [2, 4]
    commands = setup_commands([2, 4], "-z")
    assert commands[0] == b"P\x23\x01"
    assert [c[0] for c in commands[1:-1]] == [0xF2, 0xF2, 0xF4, 0xF4]
    assert b"\xf4L\x0c\x01" in commands
    assert setup_commands([], "x") == [b"]", b"L\x00\x00", b"@"]


def test_settings_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="units=15"):
        load_driver("flock:port=a,units=15")
    with pytest.raises(ValueError, match="invert='1' is not a yes_no"):
        load_driver("flock:port=a,invert=1")
    with pytest.raises(ValueError, match="needs more options"):
        load_driver("flock")


class FlockBed:
    has_line, has_clock = True, False

    def __init__(self, folder: Path, units: int) -> None:
        # of several units the first is the controller of the transmitter, without a sensor
        self.sensors = (1,) if units == 1 else tuple(range(2, units + 1))
        self.device = FakeFlock(folder, self.sensors, units)
        self.units = units
        self.serials = frozenset(f"FLOCK-{address}" for address in self.sensors)
        self.on_opening = len(self.sensors)

    def make(self) -> TrackerDriver:
        return FlockDriver(str(self.device.path), units=self.units)

    def send(self, frames: int) -> list[Sent]:
        return [self.sent(*what) for what in self.device.advance(frames)]

    def sent(self, address: int, frame: int) -> Sent:
        p = source_axes("-z") @ transmitter_position(address, frame) * 0.0254
        return f"FLOCK-{address}", float(frame), p

    def cut(self) -> None:
        self.device.cut()

    def restore(self) -> None:
        self.device.plug()


@pytest.fixture(params=[1, 3])
def flock_bed(
    tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[FlockBed]:
    need_serial()
    monkeypatch.setattr(flock, "CONFIGURING_S", 0.0)
    bed = FlockBed(tmp_path, request.param)
    yield bed
    bed.cut()


@pytest.mark.bed
class TestFlockContract(StreamDriverContract):
    @pytest.fixture
    def bed(self, flock_bed: FlockBed) -> FlockBed:
        return flock_bed


@pytest.mark.bed
def test_it_sets_up_mode_and_hemisphere_and_stops_on_closing(flock_bed: FlockBed) -> None:
    device = flock_bed.device
    with flock_bed.make():
        assert device.streaming
        assert device.grouped == (flock_bed.units > 1)
        assert device.configured == flock_bed.units
        for address in flock_bed.sensors:
            assert device.birds[address].mode == b"]"
            assert device.birds[address].hemisphere == b"\0\0"
    device.settle()
    assert not device.streaming


@pytest.mark.bed
def test_a_byte_lost_on_the_line_costs_one_record(flock_bed: FlockBed) -> None:
    with flock_bed.make() as driver:
        gather(driver, 1.0, flock_bed.on_opening)
        sent = flock_bed.device.advance(6, lose=17)
        samples = gather(driver, 1.5, len(sent) - 1)
        assert not driver.poll(1.6)
    expected = [flock_bed.sent(*what) for what in sent]
    del expected[1]  # byte 17 is in the second record of either length
    assert [s.serial for s in samples] == [serial for serial, _, _ in expected]
    for sample, (_, _, p) in zip(samples, expected, strict=True):
        assert sample.T_world_tracker.p is not None
        np.testing.assert_allclose(sample.T_world_tracker.p, p, atol=STEP)


@pytest.mark.bed
def test_inverting_turns_the_rotation_round(flock_bed: FlockBed) -> None:
    turned = []
    for invert in (False, True):
        driver = FlockDriver(str(flock_bed.device.path), units=flock_bed.units, invert=invert)
        flock_bed.device.frame = 7
        with driver:
            turned.append(gather(driver, 1.0, flock_bed.on_opening)[0].T_world_tracker.R)
    assert geodesic_angle(turned[0], turned[1]) > 0.1
    np.testing.assert_allclose(turned[0] @ turned[1], np.eye(3), atol=1e-9)


@pytest.mark.bed
def test_a_flock_without_sensors_is_not_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    need_serial()
    monkeypatch.setattr(flock, "CONFIGURING_S", 0.0)
    monkeypatch.setattr(record_source, "ANSWER_READS", 3)
    device = FakeFlock(tmp_path, sensors=(), units=2)
    try:
        for units in (1, 2):
            with pytest.raises(TrackerNotFound, match="switches are on FLY"):
                FlockDriver(str(device.path), units=units).open()
    finally:
        device.cut()
