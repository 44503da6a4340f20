"""The driver to copy keeps the contract, and takes lines from anybody."""

import socket
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.stream_contract import Sent, StreamDriverContract, gather

from lobstr_hw.drivers import load_driver
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.sample import SampleDriver, field_names, parse_line
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.trackers import TrackingState

numbers = st.lists(st.floats(-100.0, 100.0), min_size=3, max_size=3)


@given(st.from_regex(r"[A-Z0-9-]{1,12}", fullmatch=True), numbers, st.sampled_from(" ,;\t"))
def test_a_line_says_what_was_put_in(serial: str, p: list[float], separator: str) -> None:
    words = [serial, *map(repr, p), "0.6", "0", "0", "0.8"]
    record = parse_line(separator.join(words).encode() + b"\r")
    assert record is not None
    assert (record.serial, record.time_s) == (serial, None)
    np.testing.assert_array_equal(record.p, p)
    np.testing.assert_array_equal(record.quat_xyzw, [0.6, 0.0, 0.0, 0.8])


def test_fields_can_be_chosen_and_left_out() -> None:
    fields = field_names("_,ms,qw,qx,qy,qz")
    record = parse_line(b"garbage 1500 1 0 0 0", fields)
    assert record is not None
    assert (record.serial, record.p, record.time_s) == ("SAMPLE", None, 1.5)
    np.testing.assert_array_equal(record.quat_xyzw, [0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    "text", ["serial,x", "x,y,qx,qy,qz,qw", "qx,qy,qz,qw,qw", "qx,qy,qz,qw,roll", ""]
)
def test_fields_that_cannot_be_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="once each qx,qy,qz,qw"):
        field_names(text)
    with pytest.raises(ValueError, match="not between 1 and 65535"):
        SampleDriver("70000")


words = st.sampled_from(["nan", "inf", "-inf", "1e999", "0", "1", "x", "\0", "\u00a0", "", "1_0"])


@given(st.one_of(st.binary(max_size=80), st.lists(words, max_size=9).map(" ".join).map(str.encode)))
def test_any_line_is_believable_or_none(line: bytes) -> None:
    record = parse_line(line)
    if record is not None:
        assert record.p is not None
        assert np.isfinite(record.p).all()
        assert 0.5 < np.linalg.norm(record.quat_xyzw) < 2.0
        assert record.serial.isprintable()


class SampleBed:
    """Two trackers that send their own time."""

    serials = frozenset({"HIP", "CHEST"})
    has_clock, has_line, on_opening = True, False, 0

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self.frame = 0

    def make(self) -> TrackerDriver:
        return load_driver(f"sample:port={self.port},fields=serial,x,y,z,qx,qy,qz,qw,ms")

    def put(self, text: str) -> None:
        self.socket.sendto(text.encode(), ("127.0.0.1", self.port))

    def send(self, frames: int) -> list[Sent]:
        sent: list[Sent] = []
        for _ in range(frames):
            time_s, z = self.frame * 0.01, self.frame * 0.002
            for serial, y in (("HIP", 1.0), ("CHEST", 1.3)):
                self.put(f"{serial} 0 {y} {z} 0 0 0 1 {time_s * 1000.0}")
                sent.append((serial, time_s, np.array([0.0, y, z])))
            self.frame += 1
        return sent

    def cut(self) -> None:
        """UDP has no line: the device just falls silent."""

    def restore(self) -> None:
        """And goes on."""


@pytest.fixture
def bed() -> Iterator[SampleBed]:
    bed = SampleBed()
    yield bed
    bed.socket.close()


class TestSampleContract(StreamDriverContract):
    @pytest.fixture
    def bed(self, bed: SampleBed) -> SampleBed:
        return bed


def test_a_device_without_a_place_is_tracked_by_its_inertia(bed: SampleBed) -> None:
    with SampleDriver(str(bed.port), fields=("serial", "qx", "qy", "qz", "qw")) as driver:
        bed.put("IMU 0 0 0 1\nIMU 0 1 0 0\nbroken\n")
        samples = gather(driver, 1.0, 2)
    assert [(s.state, s.tracked) for s in samples] == [(TrackingState.INERTIAL, True)] * 2
    assert all(s.T_world_tracker.p is None for s in samples)


def test_what_is_no_number_is_a_serial_line() -> None:
    pytest.importorskip("serial", reason="pip install 'lobstr-hw[hid]'")
    with pytest.raises(TrackerNotFound, match="no-such-port cannot be opened"):
        SampleDriver("/dev/no-such-port").open()
