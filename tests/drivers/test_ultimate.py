"""Vive Ultimate Trackers: the dongle's bytes, what may be sent to it, and the driver.

The driver runs against a stand-in for hidapi's module here; test_ultimate_bed.py runs the same file
again behind the real hidapi, with the dongle as a device node.
"""

import ast
import importlib.util
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.fake_dongle import (
    SERIAL,
    FakeDongle,
    buttons_report,
    fake_hid_module,
    links_report,
    pair_report,
    pose_report,
    text_report,
)
from support.hidraw_testbed import ENVIRONMENT, RemoteDongle
from support.stream_contract import Sent, StreamDriverContract, gather

import lobstr_hw.drivers as drivers
from lobstr_hw.drivers import load_driver, ultimate_dongle
from lobstr_hw.drivers.driver import EventKind, TrackerDriver
from lobstr_hw.drivers.ultimate import UltimateDriver
from lobstr_hw.drivers.ultimate_reports import (
    DongleCommand,
    LinkStatus,
    MapState,
    PairEvent,
    PoseReport,
    TextReport,
    command_report,
    map_state,
    parse_report,
    read_answer,
    to_tracker,
)
from lobstr_hw.errors import DriverError
from lobstr_hw.rotations import rotation_x, rotation_z
from lobstr_hw.trackers import TrackingState

UNTURNED = [1.0, 0.0, 0.0, 0.0]
QUARTER = [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]
DANGEROUS = (0x21, 0x1C, 0x98, 0x99, 0x9A, 0x9F, 0xEB, 0xEF)
indices = st.integers(0, 4)
coordinates = st.lists(st.floats(-50.0, 50.0, width=32), min_size=3, max_size=3)


@given(indices, coordinates, st.integers(0, 255), st.integers(0, 255))
def test_a_pose_says_what_was_put_in(index: int, p: list[float], state: int, buttons: int) -> None:
    report = parse_report(pose_report(index, p, [0.5, -0.5, 0.5, 0.5], state, buttons))
    assert isinstance(report, PoseReport)
    assert (report.index, report.state, report.buttons) == (index, state, buttons)
    np.testing.assert_array_equal(report.p, p)
    np.testing.assert_array_equal(report.quat, [0.5, -0.5, 0.5, 0.5])


@given(indices, st.booleans(), st.lists(st.booleans(), min_size=5, max_size=5))
def test_the_other_reports_say_what_was_put_in(index: int, gone: bool, links: list[bool]) -> None:
    assert parse_report(pair_report(index, gone)) == PairEvent(index, not gone)
    assert parse_report(links_report(links)) == LinkStatus(tuple(links))
    assert parse_report(text_report(index, "MS0,6")) == TextReport(index, "MS0,6")
    report = parse_report(buttons_report(index, 3))
    assert isinstance(report, PoseReport)
    assert (report.p, report.buttons) == (None, 3)


@given(st.one_of(st.binary(max_size=80), st.binary(max_size=80).map(lambda b: b"\x28" + b)))
def test_any_bytes_are_a_believable_report_or_none(data: bytes) -> None:
    report = parse_report(data)
    if isinstance(report, PoseReport) and report.quat is not None:
        assert report.p is not None
        assert 0 <= report.index < 5
        assert np.isfinite(report.p).all()
        assert np.linalg.norm(report.quat) == pytest.approx(1.0, abs=0.02)


@given(st.data())
def test_a_pose_that_was_cut_is_none(data: st.DataObject) -> None:
    whole = pose_report(0, [1.0, 2.0, 3.0], UNTURNED)
    assert parse_report(whole[: data.draw(st.integers(0, 12 + 36))]) is None


@pytest.mark.parametrize(
    ("text", "state"),
    [
        ("P61:5,6", MapState.REUSED),
        ("MS-1,10", MapState.BEING_BUILT),
        ("MS0,0", MapState.NOT_CHECKED),
        ("P61:4,6", None),
        ("MS0,99", None),
        ("", None),
    ],
)
def test_the_state_of_the_map_is_read_from_messages(text: str, state: MapState | None) -> None:
    assert map_state(text) is state


@given(st.integers(0, 255), st.binary(max_size=30))
def test_no_command_but_those_on_the_list_can_be_made(command: int, data: bytes) -> None:
    allowed = {0x18, 0x1D, 0xF0, 0xFF}
    try:
        report = command_report(command, data)
    except ValueError:
        return
    assert command in allowed
    assert len(report) == 65
    assert report[:3] == bytes([0, command, len(data) + 2])
    assert command != 0x1D or data == bytes([0, 1, 1, 1, 1, 0, 0])


@pytest.mark.parametrize("command", DANGEROUS)
def test_the_commands_that_do_harm_are_refused(command: int) -> None:
    with pytest.raises(ValueError, match="is not a valid DongleCommand"):
        command_report(command, b"\0")


@pytest.mark.parametrize("text", ["APF", "APR", "APS", "ALE", "ANI0", "P64:3", "P61:5,3", "Wcus"])
def test_messages_that_erase_switch_off_or_last_for_ever_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not on the list of safe commands"):
        command_report(DongleCommand.TO_TRACKER, to_tracker(0, text))


@given(st.text("APFMT0123:6-", max_size=8), st.integers(0, 15), st.integers(0, 255))
def test_a_message_is_sent_whole_and_to_a_tracker_or_not_at_all(
    text: str, index: int, length: int
) -> None:
    data = bytearray(to_tracker(index, text))
    data[9] = length
    good = re.fullmatch(r"ATM-1|ATM20|ATM11|P63:[456]", text) is not None
    try:
        command_report(DongleCommand.TO_TRACKER, bytes(data))
    except ValueError:
        assert not (good and index < 5 and length == len(text))
    else:
        assert good
        assert index < 5
        assert length == len(text)


def test_only_one_place_writes_to_the_device_and_it_asks_the_list() -> None:
    folder = Path(drivers.__file__).parent
    calls = []
    for path in sorted(folder.glob("ultimate*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and node.attr in ("send_feature_report", "write"):
                calls.append((path.name, node.attr))
    assert calls == [("ultimate_dongle.py", "send_feature_report")]
    source = Path(ultimate_dongle.__file__).read_text(encoding="utf-8")
    assert "report = command_report(command, data)\n        if self._device.send_feature" in source


def test_an_answer_to_another_command_is_not_taken() -> None:
    answer = bytes([0, 0xFF, 7, 0, 0]) + b"1.2" + bytes(56)
    assert read_answer(answer, DongleCommand.ROM_VERSION) == b"1.2"
    assert read_answer(answer, DongleCommand.IDENTITY) is None
    assert read_answer(b"", DongleCommand.ROM_VERSION) is None


class UltimateBed:
    """Two trackers at a dongle."""

    has_line, has_clock, on_opening = True, False, 0
    serials = frozenset(f"ULTIMATE-{SERIAL}-{index}" for index in (0, 1))

    def __init__(self, dongle: FakeDongle | RemoteDongle) -> None:
        self.dongle = dongle
        self.frame = 0

    def make(self) -> TrackerDriver:
        return load_driver("ultimate")

    def send(self, frames: int) -> list[Sent]:
        sent: list[Sent] = []
        for _ in range(frames):
            for index in (0, 1):
                p = [0.25 * index, 1.0, 0.001 * self.frame]
                self.dongle.put(pose_report(index, p, UNTURNED))
                sent.append((f"ULTIMATE-{SERIAL}-{index}", float(self.frame), np.array(p)))
            self.frame += 1
        return sent

    def cut(self) -> None:
        self.dongle.unplug()

    def restore(self) -> None:
        self.dongle.plug()

    def texts(self) -> list[tuple[int, bytes]]:
        """Messages that the driver sent, with the tracker they went to."""
        sent = [report[3:] for report in self.dongle.sent() if report[1] == 0x18]
        return [(data[2] & 0x0F, data[10 : 10 + data[9]]) for data in sent]


@pytest.fixture
def bed(monkeypatch: pytest.MonkeyPatch) -> Iterator[UltimateBed]:
    path = os.environ.get(ENVIRONMENT)
    if path is None:
        dongle = FakeDongle()
        for name in ("hid", "hidraw"):
            monkeypatch.setitem(sys.modules, name, fake_hid_module(dongle))
        yield UltimateBed(dongle)
        return
    found = importlib.util.find_spec("hidraw")
    assert found is not None
    assert found.origin is not None
    assert found.origin.endswith(".so"), "the real library"
    remote = RemoteDongle(path)
    remote.plug()
    yield UltimateBed(remote)
    remote.unplug()  # forgets what was under way
    remote.close()


class TestUltimateContract(StreamDriverContract):
    @pytest.fixture
    def bed(self, bed: UltimateBed) -> UltimateBed:
        return bed


def test_turns_come_out_in_the_order_that_is_asked_for(bed: UltimateBed) -> None:
    for order, R in (("xyz", rotation_x(np.pi / 2)), ("zyx", rotation_z(np.pi / 2))):
        with load_driver(f"ultimate:order={order}") as driver:
            bed.dongle.put(pose_report(0, [0.0, 1.0, 0.0], QUARTER))
            (sample,) = gather(driver, 1.0, 1)
            np.testing.assert_allclose(sample.T_world_tracker.R, R, atol=1e-3)


def test_a_tracker_without_a_place_gives_its_rotation_only(bed: UltimateBed) -> None:
    with bed.make() as driver:
        bed.dongle.put(pose_report(0, [0.0, 1.0, 0.0], UNTURNED, state=3))
        bed.dongle.put(text_report(0, "MS0,6"))
        bed.dongle.put(pose_report(0, [0.0, 1.0, 0.0], UNTURNED, state=4))
        bed.dongle.put(pose_report(0, [0.0, 1.0, 0.0], UNTURNED, state=2))
        samples = gather(driver, 1.0, 3)
        assert [(s.state, s.tracked) for s in samples] == [
            (TrackingState.CALIBRATING, False),
            (TrackingState.INERTIAL, True),
            (TrackingState.OK, True),
        ]
        assert [s.T_world_tracker.p is None for s in samples] == [True, True, False]
        (device,) = driver.devices()
        assert device.model == "VIVE Ultimate Tracker, map reused"
        assert device.firmware == "1.0.999"


def test_a_tracker_that_only_shows_life_is_set_going_once_the_first_as_host(
    bed: UltimateBed,
) -> None:
    before = len(bed.texts())
    with bed.make() as driver:
        for report in (pair_report(1), buttons_report(1, 0), buttons_report(2, 0)):
            bed.dongle.put(report)
        gather(driver, 1.0, len(bed.send(1)))
    texts = [(i, text) for i, text in bed.texts()[before:] if text != b"P63:5"]
    assert texts == [(1, b"ATM-1"), (1, b"ATM20"), (2, b"ATM-1"), (2, b"ATM11")]


def test_it_says_nothing_to_trackers_when_it_may_not_start_them(bed: UltimateBed) -> None:
    before = len(bed.texts())
    with load_driver("ultimate:start=no") as driver:
        bed.dongle.put(pair_report(1))
        gather(driver, 1.0, len(bed.send(1)))
    assert bed.texts()[before:] == []


def test_pairing_is_allowed_only_when_asked_for(bed: UltimateBed) -> None:
    for spec, allowed in (("ultimate", False), ("ultimate:pair=yes", True)):
        before = len(bed.dongle.sent())
        with load_driver(spec):
            commands = [report[1] for report in bed.dongle.sent()[before:]]
        assert (0x1D in commands) == allowed


def test_a_button_goes_down_and_up_whatever_else_is_reported(bed: UltimateBed) -> None:
    with bed.make() as driver:
        for buttons in (0x81, 0x03, 0x80):
            bed.dongle.put(pose_report(0, [0.0, 1.0, 0.0], UNTURNED, buttons=buttons))
        gather(driver, 1.0, 3)
        told = [(e.kind, e.name) for e in driver.events()]
    assert told == [(EventKind.BUTTON_DOWN, "system"), (EventKind.BUTTON_UP, "system")]


@pytest.mark.parametrize(
    "goodbye",
    [
        pair_report(0, gone=True),
        links_report([False, True, False, False, False]),
        text_report(0, "APF1"),
    ],
    ids=["unpaired", "link", "switched off"],
)
def test_a_tracker_that_leaves_is_gone_and_the_other_is_not(
    bed: UltimateBed, goodbye: bytes
) -> None:
    with bed.make() as driver:
        gather(driver, 1.0, len(bed.send(1)))
        bed.dongle.put(goodbye)
        (sample,) = gather(driver, 1.1, 1)
        assert (sample.serial[-1], sample.state) == ("0", TrackingState.GONE)
        gone = [e.serial for e in driver.events() if e.kind is EventKind.GONE]
        assert gone == [sample.serial]


def test_everything_that_was_ever_sent_is_on_the_list(bed: UltimateBed) -> None:
    with load_driver("ultimate:pair=yes") as driver:
        bed.dongle.put(pair_report(0))
        gather(driver, 1.0, len(bed.send(300)))
    for report in bed.dongle.sent():
        length = report[2] - 2
        assert command_report(report[1], report[3 : 3 + length]) == report


def test_a_dongle_that_is_not_there_is_told(bed: UltimateBed) -> None:
    bed.dongle.unplug()
    with pytest.raises(DriverError, match=r"plug it in|cannot be opened"):
        UltimateDriver().open()
