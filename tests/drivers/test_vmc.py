"""VMC in: on real loopback sockets, from anybody."""

import math
import socket
import struct
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.stream_contract import Sent, StreamDriverContract, gather

from lobstr_hw.drivers import load_driver
from lobstr_hw.drivers.driver import EventKind, TrackerDriver
from lobstr_hw.drivers.osc import OscMessage
from lobstr_hw.drivers.vmc import VmcDriver, device_time_s, pose_from_unity, read_pose
from lobstr_hw.errors import DeviceBusy, DriverUnavailable
from lobstr_hw.rotations import from_quat_xyzw, rotation_y, to_quat_xyzw
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

DEVICES = [
    ("Hmd", "LHR-HEAD"),
    ("Con", "OculusTouch_Left"),
    ("Con", "OculusTouch_Right"),
    ("Tra", "Waist"),
]
unit = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(
    lambda q: 0.7 < math.hypot(*q) < 1.4
)
point = st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3)


def string(text: str) -> bytes:
    data = text.encode() + b"\0"
    return data + bytes(-len(data) % 4)


def packed(address: str, serial: str, *numbers: float) -> bytes:
    tags = "," + "s" + "f" * len(numbers)
    return (
        string(address) + string(tags) + string(serial) + struct.pack(f">{len(numbers)}f", *numbers)
    )


def bundle(*elements: bytes) -> bytes:
    return (
        b"#bundle\0" + bytes(7) + b"\1" + b"".join(struct.pack(">i", len(e)) + e for e in elements)
    )


def clock(time_s: float) -> bytes:
    return string("/VMC/Ext/T") + string(",f") + struct.pack(">f", time_s)


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class VmcBed:
    """A sender of four devices, with its clock or without."""

    serials = frozenset(serial for _, serial in DEVICES)
    on_opening = 0
    has_line = False

    def __init__(self, has_clock: bool) -> None:
        self.has_clock = has_clock
        self.port = free_port()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.frame = 0

    def make(self) -> TrackerDriver:
        return load_driver(f"vmc:port={self.port}")

    def put(self, data: bytes) -> None:
        self.socket.sendto(data, ("127.0.0.1", self.port))

    def send(self, frames: int) -> list[Sent]:
        sent: list[Sent] = []
        for _ in range(frames):
            time_s = 100.0 + self.frame / 90.0
            x = self.frame * 0.01
            poses = [
                packed(f"/VMC/Ext/{kind}/Pos", serial, x, 1.0, 0.1 * i, 0.0, 0.0, 0.0, 1.0)
                for i, (kind, serial) in enumerate(DEVICES)
            ]
            self.put(bundle(clock(time_s), *poses) if self.has_clock else bundle(*poses))
            sent += [
                (serial, time_s, np.array([x, 1.0, -0.1 * i]))
                for i, (_, serial) in enumerate(DEVICES)
            ]
            self.frame += 1
        return sent

    def cut(self) -> None:
        """UDP has no line: the sender just falls silent."""

    def restore(self) -> None:
        """And goes on."""


@pytest.fixture(params=[True, False], ids=["clock", "no clock"])
def vmc_bed(request: pytest.FixtureRequest) -> Iterator[VmcBed]:
    bed = VmcBed(request.param)
    yield bed
    bed.socket.close()


class TestVmcContract(StreamDriverContract):
    @pytest.fixture
    def bed(self, vmc_bed: VmcBed) -> VmcBed:
        return vmc_bed


@pytest.fixture
def bed() -> Iterator[VmcBed]:
    bed = VmcBed(has_clock=False)
    yield bed
    bed.socket.close()


@given(point, unit)
def test_unitys_mirror_image_is_undone_and_the_way_back_is_the_same(
    p: list[float], quat: list[float]
) -> None:
    q = np.array(quat) / np.linalg.norm(quat)
    pose = pose_from_unity(p, q.tolist())
    mirror = np.diag([1.0, 1.0, -1.0])
    np.testing.assert_allclose(pose.R, mirror @ from_quat_xyzw(q) @ mirror, atol=1e-9)
    assert pose.p is not None
    back = pose_from_unity(pose.p.tolist(), to_quat_xyzw(pose.R).tolist())
    np.testing.assert_allclose(back.R, from_quat_xyzw(q), atol=1e-9)
    np.testing.assert_allclose(back.p, p)  # type: ignore[arg-type]


def test_turning_left_in_unity_is_turning_left_here() -> None:
    quarter_left = [0.0, -math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4)]  # left-handed about Y
    pose = pose_from_unity([0.0, 0.0, 1.0], quarter_left)
    np.testing.assert_allclose(pose.R, rotation_y(math.pi / 2), atol=1e-12)
    np.testing.assert_allclose(pose.p, [0.0, 0.0, -1.0])  # type: ignore[arg-type]


numbers = st.one_of(st.floats(width=32), st.integers(), st.none(), st.text(max_size=3))


@settings(max_examples=50)
@given(st.text(max_size=70), st.lists(numbers, max_size=9))
def test_whatever_the_arguments_are_the_pose_is_believable_or_none(
    serial: str, values: list[float | int | str | None]
) -> None:
    for address in ("/VMC/Ext/Hmd/Pos", "/VMC/Ext/Tra/Pos/Local", "/else"):
        for args in ((serial, *values), tuple(values)):
            pose = read_pose(OscMessage(address, args))
            if pose is not None:
                R = pose.T_world_tracker.R
                np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-6)
                assert pose.T_world_tracker.p is not None
                assert np.isfinite(pose.T_world_tracker.p).all()
                assert pose.serial.isprintable()


@given(st.lists(numbers, max_size=2))
def test_a_clock_that_is_none_or_too_coarse_is_not_used(values: list[float]) -> None:
    time_s = device_time_s([OscMessage("/VMC/Ext/T", tuple(values))])
    assert time_s is None or 0.0 <= time_s < 16384.0


def test_roles_are_hinted_by_kind_and_name(bed: VmcBed) -> None:
    with bed.make() as driver:
        gather(driver, 1.0, len(bed.send(1)))
        assert {d.role_hint for d in driver.devices()} == set(FOUR_POINTS)
    told = VmcDriver(port=bed.port, left="A", right="B")
    with told as driver:
        for serial in "AB":
            bed.put(packed("/VMC/Ext/Con/Pos", serial, 0, 0, 0, 0, 0, 0, 1))
        gather(driver, 1.0, 2)
        hints = {d.serial: d.role_hint for d in driver.devices()}
    assert hints == {"A": TrackerRole.LEFT_HAND, "B": TrackerRole.RIGHT_HAND}


def test_of_two_coordinates_the_rooms_own_are_taken(bed: VmcBed) -> None:
    both = bundle(
        packed("/VMC/Ext/Tra/Pos", "T", 1, 0, 0, 0, 0, 0, 1),
        packed("/VMC/Ext/Tra/Pos/Local", "T", 2, 0, 0, 0, 0, 0, 1),
    )
    for space, x in (("auto", 2.0), ("local", 2.0), ("pos", 1.0)):
        with load_driver(f"vmc:port={bed.port},space={space}") as driver:
            bed.put(both)
            (sample,) = gather(driver, 1.0, 1)
            assert sample.T_world_tracker.p is not None
            assert sample.T_world_tracker.p[0] == x


def test_another_app_can_ask_for_the_calibration(bed: VmcBed) -> None:
    with bed.make() as driver:
        bed.put(string("/VMC/Ext/Set/Calib/Ready") + string(","))
        bed.put(string("/VMC/Ext/Set/Calib/Exec") + string(",i") + struct.pack(">i", 0))
        gather(driver, 1.0, len(bed.send(1)))
        told = [(e.kind, e.name) for e in driver.events()]
    assert told == [(EventKind.COMMAND, "calibrate_ready"), (EventKind.COMMAND, "calibrate")]


@given(st.lists(st.binary(max_size=120), max_size=6))
def test_datagrams_of_anything_do_no_harm(datagrams: list[bytes]) -> None:
    driver = VmcDriver()
    for data in datagrams:
        list(driver._arrivals(data))
        list(driver._arrivals(bundle(data, packed("/VMC/Ext/Hmd/Pos", "H", *[math.nan] * 7))))
    assert not driver.devices()


def test_other_addresses_and_noise_on_the_socket_are_ignored(bed: VmcBed) -> None:
    with bed.make() as driver:
        for data in (
            b"",
            b"\xff" * 50,
            b"#bundle\0",
            packed("/VMC/Ext/Bone/Pos", "Hips", *[0] * 7),
        ):
            bed.put(data)
        sent = bed.send(1)
        assert {s.serial for s in gather(driver, 1.0, len(sent))} == bed.serials


def test_a_sender_that_makes_up_serials_fills_no_memory(bed: VmcBed) -> None:
    driver = VmcDriver()
    for number in range(1000):
        list(driver._arrivals(packed("/VMC/Ext/Tra/Pos", f"S{number}", 0, 0, 0, 0, 0, 0, 1)))
    assert len(driver._kinds) == 64


@pytest.mark.skipif(sys.platform == "darwin", reason="macOS has no 127.0.0.2")
def test_it_listens_to_this_machine_only_unless_told_otherwise() -> None:
    port = free_port()
    with VmcDriver(port=port), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.2", port))  # free: the driver has 127.0.0.1, not all addresses


def test_a_taken_port_and_a_strange_address_are_told(bed: VmcBed) -> None:
    with bed.make(), pytest.raises(DeviceBusy, match=r"in use by another program.*port="):
        bed.make().open()
    with pytest.raises(DriverUnavailable, match="must be an address of this machine"):
        VmcDriver(bind="192.0.2.1").open()
    with pytest.raises(ValueError, match="not between 1 and 65535"):
        VmcDriver(port=0)
