"""Polhemus trackers: their bytes, and the driver behind the real pyserial."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.fake_polhemus import (
    FakePolhemus,
    fastrak_record,
    liberty_record,
    quat_at,
    source_position,
)
from support.serial_bed import need_serial
from support.stream_contract import Sent, StreamDriverContract, gather

from lobstr_hw.drivers import record_source
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.magnetic import axis_vector, signed_axis, source_axes, world_pose
from lobstr_hw.drivers.polhemus import PolhemusDriver
from lobstr_hw.drivers.polhemus_records import (
    PolhemusModel,
    PolhemusRecord,
    parse_fastrak,
    parse_liberty,
    setup_commands,
)
from lobstr_hw.drivers.serial_stream import cut_records
from lobstr_hw.errors import DeviceBusy, TrackerNotFound
from lobstr_hw.rotations import Array, from_quat_xyzw

MODELS = list(PolhemusModel)
AXES = ["x", "y", "z", "-x", "-y", "-z"]

Make = Callable[[int, Array, Array], bytes]
Parse = Callable[[bytes], PolhemusRecord | None]

positions = st.lists(st.floats(-300.0, 300.0, width=32), min_size=3, max_size=3).map(np.array)


@st.composite
def unit_quats(draw: st.DrawFn) -> Array:
    q = np.array(draw(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4)))
    norm = float(np.linalg.norm(q))
    return q / norm if norm > 0.1 else np.array([1.0, 0.0, 0.0, 0.0])


@given(st.integers(1, 4), positions, unit_quats(), st.sampled_from([b" ", b"A", b"f"]))
def test_a_fastrak_record_says_what_was_put_in(
    station: int, p: Array, quat: Array, status: bytes
) -> None:
    record = parse_fastrak(fastrak_record(station, p, quat, status))
    assert record is not None
    assert (record.station, record.tracked, record.time_ms) == (station, status == b" ", None)
    np.testing.assert_allclose(record.p_inches, p, rtol=1e-6)
    np.testing.assert_allclose(record.quat_wxyz, quat, atol=1e-6)


@given(st.integers(1, 16), positions, unit_quats(), st.integers(0, 2**32 - 1))
def test_a_liberty_record_says_what_was_put_in(
    station: int, p: Array, quat: Array, time_ms: int
) -> None:
    record = parse_liberty(liberty_record(station, p, quat, time_ms))
    assert record is not None
    assert (record.station, record.tracked, record.time_ms) == (station, True, time_ms)
    np.testing.assert_allclose(record.p_inches, p, rtol=1e-6)
    np.testing.assert_allclose(record.quat_wxyz, quat, atol=1e-6)


def test_an_error_of_the_device_is_not_tracked() -> None:
    record = parse_liberty(liberty_record(1, np.zeros(3), np.eye(4)[0], error=b"A"))
    assert record is not None
    assert not record.tracked


@given(st.binary(min_size=41, max_size=41))
def test_any_bytes_are_a_believable_record_or_none(data: bytes) -> None:
    for record in (parse_fastrak(data[:32]), parse_liberty(data)):
        if record is not None:
            assert 1 <= record.station <= 16
            assert np.linalg.norm(record.quat_wxyz) == pytest.approx(1.0, abs=0.02)
            assert np.isfinite(record.p_inches).all()


@given(st.integers(0, 31), st.integers(0, 27), st.floats(allow_nan=True, width=32))
def test_numbers_that_are_no_pose_are_no_record(byte: int, at: int, number: float) -> None:
    good = fastrak_record(1, np.ones(3), np.eye(4)[0])
    data = bytearray(good)
    data[byte] ^= 0x80
    record = parse_fastrak(bytes(data))
    assert record is None or np.isfinite(record.p_inches).all()
    broken = good[:15] + np.full(4, number, np.float32).tobytes() + good[31:]
    unit = np.isfinite(number) and abs(4 * number * number - 1.0) < 0.02
    assert (parse_fastrak(broken) is not None) == unit


@given(st.data())
def test_after_a_lost_byte_only_the_record_it_was_in_is_missing(data: st.DataObject) -> None:
    kinds: list[tuple[Make, Parse, int]] = [
        (fastrak_record, parse_fastrak, 32),
        (liberty_record, parse_liberty, 41),
    ]
    make, parse, length = data.draw(st.sampled_from(kinds))
    times = np.arange(6) / 60.0
    stream = b"".join(make(1, source_position(1, t), quat_at(1, t)) for t in times)
    lost = data.draw(st.integers(0, 5 * length - 1))
    records, rest = cut_records(stream[:lost] + stream[lost + 1 :], length, parse)
    expected = [source_position(1, t) for i, t in enumerate(times) if i != lost // length]
    np.testing.assert_allclose([r.p_inches for r in records], expected, rtol=1e-5)
    assert rest == b""


@given(st.binary(max_size=60), st.lists(st.integers(1, 90), max_size=8))
def test_strange_bytes_before_and_pieces_of_any_size_hide_no_later_record(
    strange: bytes, cuts: list[int]
) -> None:
    record = fastrak_record(2, source_position(2, 0.0), quat_at(2, 0.0))
    stream = strange.replace(b"0", b"1") + record * 3
    found, buffer = [], b""
    edges = sorted({0, len(stream), *(c for c in cuts if c < len(stream))})
    for begin, end in pairwise(edges):
        new, buffer = cut_records(buffer + stream[begin:end], 32, parse_fastrak)
        found += new
    assert len(found) == 3


@pytest.mark.parametrize("up", AXES)
def test_the_axis_named_up_points_up_and_a_parallel_sensor_is_unturned(up: str) -> None:
    R = source_axes(up)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    pose = world_pose(R, axis_vector(up), np.array([1.0, 0.0, 0.0, 0.0]))
    assert pose.p is not None
    np.testing.assert_allclose(pose.p, [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(pose.R, np.eye(3), atol=1e-12)


def test_a_standing_source_has_forward_right_and_down() -> None:
    R = source_axes("-z")
    np.testing.assert_allclose(R @ [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(R @ [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(R @ [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], atol=1e-12)


@given(st.sampled_from(AXES), unit_quats(), unit_quats())
def test_turns_between_two_readings_are_the_sensors_own(up: str, a: Array, b: Array) -> None:
    R = source_axes(up)
    poses = [world_pose(R, np.zeros(3), q).R for q in (a, b)]
    source = [from_quat_xyzw(np.roll(q, -1)) for q in (a, b)]
    np.testing.assert_allclose(poses[1] @ poses[0].T, R @ source[1] @ source[0].T @ R.T, atol=1e-9)


def test_axes_that_do_not_exist_and_stations_that_are_not_there_are_refused() -> None:
    with pytest.raises(ValueError, match="is not one of x, y, z"):
        signed_axis("up")
    with pytest.raises(ValueError, match="fastrak has 1 to 4"):
        PolhemusDriver(stations=5)


@pytest.mark.parametrize("model", MODELS)
def test_setting_up_begins_with_stop_and_ends_with_go(model: PolhemusModel) -> None:
    commands = setup_commands(model, 2, "-z")
    assert commands[0] in (b"c", b"P")
    assert commands[-1].startswith(b"C")
    star = b"2" if model is PolhemusModel.FASTRAK else b"*"
    assert b"H" + star + b",0,0,-1\r" in commands


class PolhemusBed:
    has_line = True

    def __init__(self, folder: Path, model: PolhemusModel) -> None:
        self.device = FakePolhemus(folder, model)
        self.model = model
        self.serials = frozenset({"POLHEMUS-1", "POLHEMUS-2"})
        self.on_opening = 2
        self.has_clock = model is not PolhemusModel.FASTRAK

    def make(self) -> TrackerDriver:
        return PolhemusDriver(model=self.model, port=str(self.device.path), stations=2)

    def send(self, frames: int) -> list[Sent]:
        return [self.sent(*what) for what in self.device.advance(frames)]

    def sent(self, station: int, time_s: float) -> Sent:
        p = source_axes("-z") @ source_position(station, time_s) * 0.0254
        return f"POLHEMUS-{station}", time_s, p

    def cut(self) -> None:
        self.device.cut()

    def restore(self) -> None:
        self.device.plug()


@pytest.fixture(params=MODELS)
def polhemus_bed(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[PolhemusBed]:
    need_serial()
    bed = PolhemusBed(tmp_path, request.param)
    yield bed
    bed.cut()


@pytest.mark.bed
@pytest.mark.parametrize(
    "polhemus_bed", [PolhemusModel.FASTRAK, PolhemusModel.LIBERTY], indirect=True
)
class TestPolhemusContract(StreamDriverContract):
    @pytest.fixture
    def bed(self, polhemus_bed: PolhemusBed) -> PolhemusBed:
        return polhemus_bed


@pytest.mark.bed
def test_it_sets_up_units_items_and_hemisphere(polhemus_bed: PolhemusBed) -> None:
    device = polhemus_bed.device
    with polhemus_bed.make():
        assert device.binary
        assert device.continuous
        assert not device.metric
        assert device.hemispheres[1] == device.hemispheres[2] == "1,0,0"


@pytest.mark.bed
def test_a_byte_lost_on_the_line_costs_one_record(polhemus_bed: PolhemusBed) -> None:
    with polhemus_bed.make() as driver:
        gather(driver, 1.0, 2)
        sent = polhemus_bed.device.advance(5, lose=50)
        samples = gather(driver, 1.5, len(sent) - 1)
        expected = [polhemus_bed.sent(*what) for what in sent]
        del expected[1]  # byte 50 is in the second record of either length
        assert [s.serial for s in samples] == [serial for serial, _, _ in expected]
        for sample, (_, _, p) in zip(samples, expected, strict=True):
            assert sample.T_world_tracker.p is not None
            np.testing.assert_allclose(sample.T_world_tracker.p, p, atol=1e-6)


@pytest.mark.bed
def test_a_port_that_is_not_there_or_taken_or_silent_is_told(polhemus_bed: PolhemusBed) -> None:
    with pytest.raises(TrackerNotFound, match=r"no-such-port cannot be opened .* ports here"):
        PolhemusDriver(port="/dev/no-such-port").open()
    with polhemus_bed.make(), pytest.raises(DeviceBusy, match="in use by another program"):
        polhemus_bed.make().open()


@pytest.mark.bed
def test_a_device_without_sensors_is_not_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    need_serial()
    monkeypatch.setattr(record_source, "ANSWER_READS", 3)
    device = FakePolhemus(tmp_path, PolhemusModel.FASTRAK, sensors=0)
    try:
        with pytest.raises(TrackerNotFound, match="no record of a fastrak came from"):
            PolhemusDriver(port=str(device.path)).open()
    finally:
        device.cut()
