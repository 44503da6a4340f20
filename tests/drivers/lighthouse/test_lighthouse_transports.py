"""Transports without USB: what they make of what libraries list, refuse and lack."""

import threading
from collections.abc import Iterator
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.fake_transport import FakeTransport, FakeUsbDevice
from support.scripted_usb import ScriptedDevice
from support.waiting import wait_until

from lobstr_hw.drivers.driver import Probe
from lobstr_hw.drivers.lighthouse.device_commands import (
    ask_ranges,
    ask_version,
    download_config,
    parse_version,
    set_light_mode,
    start_reports,
)
from lobstr_hw.drivers.lighthouse.hidapi_transport import HidapiTransport
from lobstr_hw.drivers.lighthouse.pyusb_transport import PyusbTransport
from lobstr_hw.drivers.lighthouse.report_queue import QUEUE_LENGTH, ReportQueue
from lobstr_hw.drivers.lighthouse.transport import LinkLost, NoAnswer, OpenDevice
from lobstr_hw.drivers.lighthouse.transports import available_transports, choose_transport
from lobstr_hw.drivers.lighthouse.usb_ids import DeviceKind, kind_of
from lobstr_hw.errors import DeviceBusy, DriverUnavailable, FileFormatError, TrackerNotFound

Entry = dict[str, Any]


def entry(
    path: bytes,
    interface: int,
    serial: str | None = "A",
    vendor: int = 0x28DE,
    product: int = 0x2300,
) -> Entry:
    return {
        "path": path, "vendor_id": vendor, "product_id": product, "serial_number": serial,
        "interface_number": interface, "product_string": "it",
    }  # fmt: skip


class FakeHid:
    """A module with the face of hidapi's."""

    def __init__(self, entries: list[Entry]) -> None:
        self.entries, self.refused = entries, set[bytes]()
        self.opened: list[bytes] = []
        bus = self

        class Device:
            def open_path(self, path: bytes) -> None:
                if path in bus.refused:
                    raise OSError("open failed")
                self.path = path
                bus.opened.append(path)

            def close(self) -> None:
                if hasattr(self, "path"):
                    bus.opened.remove(self.path)
                    del self.path

            def read(self, length: int, timeout_ms: int) -> list[int]:
                threading.Event().wait(0.001)
                return []

        self.device = Device

    def enumerate(self, vendor: int, product: int) -> list[Entry]:
        return [e for e in self.entries if e["vendor_id"] == vendor]


@pytest.fixture
def hid(monkeypatch: pytest.MonkeyPatch) -> FakeHid:
    fake = FakeHid([])
    module = ModuleType("hid")
    module.__spec__ = ModuleSpec("hid", None)
    module.__dict__.update(enumerate=fake.enumerate, device=fake.device)
    monkeypatch.setitem(__import__("sys").modules, "hid", module)
    return fake


HIDAPI = HidapiTransport("hidapi", "hid")


def test_interfaces_are_put_together_by_serial_and_strangers_left_out(hid: FakeHid) -> None:
    hid.entries = [
        entry(b"b1", 1, "B"), entry(b"a2", 2), entry(b"b0", 0, "B"), entry(b"a0", 0),
        entry(b"a1", 1), entry(b"k", 0, "K", 0x28DE, 0x1142),
        entry(b"m", 0, "M", 0x0BB4, 0x0CCC),
    ]  # fmt: skip
    found = {info.serial: info for info in HIDAPI.enumerate()}
    assert set(found) == {"A", "B"}
    assert found["A"].interfaces == ((0, b"a0"), (1, b"a1"), (2, b"a2"))
    assert found["B"].interfaces == ((0, b"b0"), (1, b"b1"))
    assert found["A"].name == "Lighthouse device (28de:2300) A"


@pytest.mark.parametrize("serial", ["", None, "SAME"])
def test_devices_that_cannot_be_told_by_serial_are_still_two(
    hid: FakeHid, serial: str | None
) -> None:
    hid.entries = [
        entry(f"/dev/hidraw{k}".encode(), k % 3, serial) for k in range(6)
    ]  # in the order in which they were plugged in
    found = HIDAPI.enumerate()
    assert sorted(len(info.interfaces) for info in found) == [3, 3]
    assert len({info.key for info in found}) == 2
    assert len({path for info in found for _, path in info.interfaces}) == 6


def test_collections_and_usages_of_one_interface_are_one(hid: FakeHid) -> None:
    path = rb"\\?\hid#vid_28de&pid_2300&mi_00&Col0%d#8&1"
    hid.entries = [entry(path % 1, 0), entry(path % 2, 0), entry(path % 1, 0), entry(b"x", -1, "B")]
    found = {info.serial: info.interfaces for info in HIDAPI.enumerate()}
    assert found == {"A": ((0, path % 1),), "B": ((0, b"x"),)}


def test_a_device_that_opens_half_way_is_let_go_of_and_named(hid: FakeHid) -> None:
    hid.entries = [entry(b"a0", 0), entry(b"a1", 1)]
    (info,) = HIDAPI.enumerate()
    hid.refused = {b"a1"}
    with pytest.raises(DeviceBusy, match=r"Lighthouse device \(28de:2300\) A cannot be opened"):
        HIDAPI.open(info)
    assert hid.opened == []
    hid.entries = []
    with pytest.raises(TrackerNotFound, match="plug it in again"):
        HIDAPI.open(info)


def test_closing_twice_is_harmless_and_leaves_nothing(hid: FakeHid) -> None:
    hid.entries = [entry(b"a0", 0), entry(b"a1", 1)]
    (info,) = HIDAPI.enumerate()
    opened = HIDAPI.open(info)
    assert sorted(hid.opened) == [b"a0", b"a1"]
    opened.close()
    opened.close()
    assert hid.opened == []
    assert [t for t in threading.enumerate() if t.name == "lobstr-usb"] == []
    with pytest.raises(LinkLost, match="closed"):
        opened.read(0.0)


@pytest.mark.parametrize("named", [None, "hidapi"])
def test_what_is_missing_is_told_with_its_cure(
    monkeypatch: pytest.MonkeyPatch, named: str | None
) -> None:
    lack = Probe(available=False, missing="the Python package x", fix="pip install x")
    monkeypatch.setattr(HidapiTransport, "probe", lambda self: lack)
    monkeypatch.setattr(PyusbTransport, "probe", lambda self: lack)
    usable, missing = available_transports()
    assert not usable
    assert {m.name for m in missing} >= {"hidapi", "pyusb"}
    with pytest.raises(DriverUnavailable, match="hidapi needs the Python package x: pip install x"):
        choose_transport(named)


def test_a_transport_of_another_name_is_refused() -> None:
    with pytest.raises(ValueError, match="transport=usb: here there are"):
        choose_transport("usb")


def test_the_next_best_transport_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    lack = Probe(available=False, missing="it", fix="get it")
    monkeypatch.setattr(HidapiTransport, "probe", lambda self: lack)
    monkeypatch.setattr(PyusbTransport, "probe", lambda self: Probe(available=True))
    assert choose_transport().name == "pyusb"
    with pytest.raises(DriverUnavailable, match="hidapi needs it: get it"):
        choose_transport("hidapi")


@given(st.integers(0, 2**16 - 1))
def test_every_identity_of_valve_s_lighthouse_range_is_known_or_unknown(product: int) -> None:
    kind = kind_of(0x28DE, product)
    assert (kind is not None) == (0x2000 <= product < 0x2400)
    assert kind_of(0x1234, product) is None


class Line:
    """What an interface sends, in a queue that a test fills."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.error: Exception | None = None

    def fetch(self) -> bytes:
        if self.sent:
            return self.sent.pop(0)
        if self.error is not None:
            raise self.error
        threading.Event().wait(0.001)
        return b""


@pytest.fixture
def lines() -> Iterator[tuple[Line, Line, ReportQueue]]:
    a, b = Line(), Line()
    queue = ReportQueue({0: a.fetch, 1: b.fetch})
    yield a, b, queue
    queue.close()


def test_what_nobody_reads_is_dropped_oldest_first_and_counted(
    lines: tuple[Line, Line, ReportQueue],
) -> None:
    a, _, queue = lines
    everything = [k.to_bytes(2, "big") for k in range(QUEUE_LENGTH + 100)]
    a.sent = list(everything)
    wait_until(lambda: queue.dropped == 100, "100 reports are dropped", 30.0)
    kept = [queue.read(0.0) for _ in range(QUEUE_LENGTH)]
    assert [report.data for report in kept if report] == everything[100:]
    assert queue.read(0.0) is None


@pytest.mark.parametrize("error", [OSError("gone"), LinkLost("gone"), RuntimeError("a bug")])
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_lost_interface_ends_the_device_after_what_came(
    lines: tuple[Line, Line, ReportQueue], error: Exception
) -> None:
    a, b, queue = lines
    a.sent = [b"1", b"2"]
    wait_until(lambda: not a.sent, "both are fetched", 30.0)
    b.error = error
    wait_until(lambda: bool(queue.lost), "the loss is seen", 30.0)
    came = [queue.read(1.0), queue.read(1.0)]
    assert [(r.interface, r.data) for r in came if r] == [(0, b"1"), (0, b"2")]
    with pytest.raises(LinkLost, match=r"gone|its reading ended"):
        queue.read(1.0)


def test_reports_are_stamped_in_their_order(lines: tuple[Line, Line, ReportQueue]) -> None:
    a, b, queue = lines
    a.sent, b.sent = [b"x"] * 50, [b"y"] * 50
    stamps = [report.arrived_s for _ in range(100) if (report := queue.read(30.0))]
    assert len(stamps) == 100
    assert stamps == sorted(stamps)


def opened(kind: int = 0x2300, **features: list[bytes]) -> tuple[FakeUsbDevice, OpenDevice]:
    script = ScriptedDevice(0x28DE, kind, features={int(k[1:], 16): v for k, v in features.items()})
    device = FakeUsbDevice(script)
    bus = FakeTransport([device])
    return device, bus.open(bus.enumerate()[0])


def test_zeros_instead_of_ranges_are_asked_for_again_and_given_up() -> None:
    _, says = opened(f01=[bytes(64), b"\x01\0\0", b"\x01\x03\x02"])
    ranges = ask_ranges(says)
    assert ranges is not None and ranges.acc_g == 8.0
    _, zeros = opened(f01=[bytes(64)])
    assert ask_ranges(zeros) is None


@given(st.binary(max_size=64))
def test_any_version_is_one_or_none(data: bytes) -> None:
    version = parse_version(data)
    assert (version is not None) == (len(data) >= 49 and data[0] == 5)
    assert version is None or version.name.isprintable()


@given(st.lists(st.binary(min_size=1, max_size=64), max_size=5), st.binary(max_size=64))
def test_any_answers_to_the_question_for_a_configuration_end_in_an_error_that_is_told(
    pieces: list[bytes], start: bytes
) -> None:
    _, device = opened(f10=[b"\x10" + start], f11=pieces)
    with pytest.raises(FileFormatError, match=r"Lighthouse device .* the device's configuration"):
        download_config(device)


def test_a_configuration_without_end_is_cut() -> None:
    _, device = opened(f10=[b"\x10"], f11=[b"\x11\x3e" + b"\x78" * 62])
    with pytest.raises(FileFormatError):
        download_config(device)


@pytest.mark.parametrize("gen2", [False, True])
def test_what_a_device_is_told_depends_on_how_it_is_reached(gen2: bool) -> None:
    cable, by_cable = opened(0x2300)
    dongle, by_radio = opened(0x2101)
    assert (by_cable.info.kind, by_radio.info.kind) == (DeviceKind.BY_CONFIG, DeviceKind.DONGLE)
    for device in (by_cable, by_radio):
        start_reports(device, gen2)
        set_light_mode(device, not gen2)
    modes = [data[1] for data in cable.answers.sent if data[0] == 0x04]
    assert modes == [gen2, not gen2]
    modes = [data[4] for data in dongle.answers.sent if data[1:3] == b"\x87\x06"]
    assert modes == [gen2, not gen2]
    assert all(data[0] == 0xFF and data[1] in (0x96, 0x87) for data in dongle.answers.sent)


def test_a_command_that_is_refused_is_told() -> None:
    device, says = opened()
    device.answers.stalled = {0x04}
    with pytest.raises(NoAnswer, match="feature report 04"):
        start_reports(says, gen2=True)
    assert ask_version(says) is None
