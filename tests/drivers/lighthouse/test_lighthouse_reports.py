"""Reports, radio messages and light data of Lighthouse devices, byte by byte."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lobstr_hw.drivers.lighthouse.compact_light import parse_compact_light
from lobstr_hw.drivers.lighthouse.device_reader import DeviceReader
from lobstr_hw.drivers.lighthouse.gen2_words import SweepWord, SyncWord, parse_words
from lobstr_hw.drivers.lighthouse.imu import ImuRanges, parse_ranges
from lobstr_hw.drivers.lighthouse.radio import Inputs, parse_message
from lobstr_hw.drivers.lighthouse.reports import ImuReport, PulseReport, parse_report
from lobstr_hw.drivers.lighthouse.ticks import LATE, Ticks

COUNTS = st.tuples(*[st.integers(-32768, 32767)] * 6)


def slot(sequence: int, ticks: int, counts: tuple[int, ...] = (0,) * 6) -> bytes:
    return struct.pack("<6hIB", *counts, ticks % 2**32, sequence % 256)


def imu_report(*slots: bytes) -> bytes:
    return b"\x20" + b"".join(slots)


def radio_message(ticks: int, payload: bytes) -> bytes:
    head = bytes([ticks >> 24 & 0xFF, len(payload) + 1, ticks >> 16 & 0xFF])
    return (head + payload).ljust(29, b"\xaa")


def imu_block(ticks: int, counts: tuple[int, ...] = (1, 2, 3, 4, 5, 6)) -> bytes:
    return struct.pack("<B6h", ticks >> 8 & 0xFF, *counts)


@given(COUNTS, st.integers(0, 2**32 - 1), st.integers(0, 255))
def test_imu_counts_and_time_come_out_as_they_went_in(
    counts: tuple[int, ...], ticks: int, sequence: int
) -> None:
    report = parse_report(imu_report(*[slot(sequence, ticks, counts)] * 3))
    assert isinstance(report, ImuReport)
    assert report.slots == ((sequence, ticks, counts),) * 3


@given(st.integers(0, 255), st.lists(st.integers(1, 3), max_size=30), st.randoms())
def test_every_imu_sample_is_given_once_and_in_order_wherever_it_stands(
    first: int, steps: list[int], random: object
) -> None:
    reader = DeviceReader(old_radio=False, gen2_light=False)
    newest = 2
    for step in [0, *steps]:
        newest += step
        three = [slot(first + k, 1_000 * k) for k in range(newest - 2, newest + 1)]
        random.shuffle(three)  # type: ignore[attr-defined]
        reader.feed(imu_report(*three))
    assert reader.take().imu[:, 0].tolist() == [1_000 * k for k in range(newest + 1)]


def test_empty_slots_of_pulse_reports_are_left_out() -> None:
    pulses = [(3, 120, 5_000), (254, 0, 0), (31, 3_000, 2**32 - 1), *[(255, 0, 0)] * 6]
    new = b"\x25" + b"".join(struct.pack("<BHI", *pulse) for pulse in pulses)
    old = b"\x21" + b"".join(struct.pack("<HHI", *pulse) for pulse in pulses[:7]) + b"\0"
    for data in (new, old):
        report = parse_report(data)
        assert isinstance(report, PulseReport)
        assert report.pulses == ((3, 5_000, 120), (31, 2**32 - 1, 3_000))


@given(
    st.lists(
        st.one_of(
            st.builds(
                SyncWord, st.integers(0, 15), st.integers(0, 2**24 - 1), *[st.integers(0, 1)] * 2
            ),
            st.builds(
                SweepWord,
                st.integers(0, 15),
                st.integers(0, 31),
                st.integers(0, 2**24 - 1),
                st.integers(0, 1),
            ),
        )
    )
)
def test_gen2_words_come_out_as_they_went_in(words: list[SyncWord | SweepWord]) -> None:
    data = b""
    for word in words:
        data += bytes([word.channel << 4 | 1])
        if isinstance(word, SyncWord):
            number = word.time << 2 | word.data_bit << 26 | word.g_bit << 27
        else:
            number = 2 | word.half_tick << 2 | word.time << 3 | word.port << 27
        data += struct.pack("<I", number)
    assert parse_words(data) == words


def test_words_without_a_channel_and_after_a_broken_marker_mean_nothing() -> None:
    sync = struct.pack("<I", 400)
    assert parse_words(sync) == []
    assert parse_words(b"\x31" + sync + b"\x33" + sync) == [SyncWord(3, 100, 0, 0)]
    assert parse_words(b"\x31" + sync[:3]) == []


def backwards(value: int) -> bytes:
    """A number as a compact message holds it, to be read from its last byte on."""
    digits = []
    while value > 0x7F:
        digits.append(value & 0x7F)
        value >>= 7
    digits.append(value)
    digits[-1 if len(digits) == 1 else 0] |= 0x80
    return bytes(digits)


@given(
    st.lists(
        st.tuples(st.integers(0, 23), st.integers(1, 5_000), st.integers(1, 9_000)),
        min_size=1,
        max_size=6,
    ),
    st.integers(10**6, 2**31),
)
def test_compact_light_gives_the_pulses_that_were_packed(
    pulses: list[tuple[int, int, int]], last: int
) -> None:
    """Pulses one after the other: each port, length, and the dark before the next."""
    edge, expected, intervals = last, [], []
    for port, length, dark in pulses:
        expected.append((port, edge - length, length))
        intervals += [length, dark]
        edge -= length + dark
    numbers = b"".join(backwards(n) for n in reversed(intervals[:-1]))
    data = (
        bytes(port << 3 for port, _, _ in pulses)
        + numbers
        + (last & 0xFFFFFF).to_bytes(3, "little")
    )
    assert parse_compact_light(data, last) == expected[::-1]


def test_compact_light_pairs_overlapping_pulses_by_the_edges_they_skip() -> None:
    # edges 1000 (end of a), 990 (end of b), 900 (start of a), 800 (start of b)
    data = bytes([5 << 3 | 1, 9 << 3 | 1]) + bytes([0x80 | 100, 0x80 | 90, 0x80 | 10])
    assert parse_compact_light(data + b"\0\0\0", 1_000) == [(9, 800, 190), (5, 900, 100)]


def test_light_that_contradicts_itself_is_none() -> None:
    assert parse_compact_light(bytes([1 << 3 | 5, 0x8A]) + b"\0\0\0", 1_000) == []
    assert parse_compact_light(bytes([1 << 3, 2 << 3, 0x8A]) + b"\0\0\0", 1_000) == []
    without_end = bytes([1 << 3, 0xFF, *[0x7F] * 18]) + b"\0\0\0"
    assert parse_compact_light(without_end, 1_000) == []


TICKS = 0x12345600


@pytest.mark.parametrize(
    ("payload", "imu", "light", "inputs"),
    [
        (b"\xe8" + imu_block(TICKS) + b"light", True, b"light", None),
        (b"\x08light", False, b"\x08light", None),
        (b"\xf9\x21" + imu_block(TICKS), True, b"", Inputs(buttons=0x21)),
        (b"\xf7\x21\x80\x01\x00\xff\xff", False, b"", Inputs(0x21, 0x80, (1, -1))),
        (b"\xe1\xb2\xe8" + imu_block(TICKS), True, b"", None),
        (b"\xe2rubbish", False, b"", None),
    ],
)
def test_old_radio_messages(payload: bytes, imu: bool, light: bytes, inputs: Inputs | None) -> None:
    message = parse_message(radio_message(TICKS, payload), old_protocol=True)
    assert message is not None
    assert (message.imu is not None, message.light, message.inputs) == (imu, light, inputs)
    assert message.ticks == (TICKS if imu else TICKS & 0xFFFF0000)


def test_new_radio_messages_have_their_parts_in_order() -> None:
    parts = bytes([0xF0]) + imu_block(TICKS) + b"\x80\xcb" + b"\x01\x04" + b"\x31light"
    message = parse_message(radio_message(TICKS, parts), old_protocol=False)
    assert message is not None
    assert (message.imu, message.battery, message.charging) == ((1, 2, 3, 4, 5, 6), 0.75, True)
    assert (message.inputs, message.light) == (Inputs(buttons=4), b"\x31light")


def test_an_unknown_part_drops_what_follows_and_keeps_what_was_before() -> None:
    parts = bytes([0xD0]) + imu_block(TICKS) + b"\x70light"
    message = parse_message(radio_message(TICKS, parts), old_protocol=False)
    assert message is not None
    assert message.imu == (1, 2, 3, 4, 5, 6)
    assert message.light == b""


def test_light_right_after_a_change_of_mode_is_not_read_in_the_new_way() -> None:
    reader = DeviceReader(old_radio=False, gen2_light=False)
    words = b"\x10" + b"\x31" + struct.pack("<I", 400)
    reader.feed(b"\x23" + radio_message(0, b"\x80" + imu_block(0)))
    reader.switch_light(gen2=True)
    for _ in range(30):
        reader.feed(b"\x23" + radio_message(0, words))
    assert len(reader.take().syncs) == 10


@given(st.integers(0, 2**40), st.lists(st.integers(1, 2**31), max_size=20))
def test_unwrapped_time_goes_on_where_the_device_wraps(start: int, steps: list[int]) -> None:
    ticks, true = Ticks(), start % 2**32
    assert ticks.imu(true) == true
    for step in steps:
        true += step
        assert ticks.imu(true % 2**32) == true


@given(st.integers(0, 2**40), st.integers(-(2**23), 2**23 - 1))
def test_light_is_taken_near_the_newest_sample(newest: int, offset: int) -> None:
    ticks = Ticks()
    assert ticks.light(5, 24) is ticks.light(5, 32) is None
    base = ticks.imu(newest % 2**32)
    assert ticks.light((base + offset) % 2**24, 24) == base + offset
    assert ticks.light((base + offset) % 2**32, 32) == base + offset


def test_a_late_sample_is_not_taken_for_a_wrap() -> None:
    ticks = Ticks()
    ticks.imu(2 * LATE)
    assert ticks.imu(2 * LATE - 192_000) == 2 * LATE - 192_000
    assert ticks.newest == 2 * LATE


def test_imu_ranges_are_powers_of_two_and_zeros_mean_ask_again() -> None:
    assert parse_ranges(bytes([1, 3, 2])) == ImuRanges(2000.0, 8.0)
    assert parse_ranges(bytes([1, 1, 1])) == ImuRanges(500.0, 4.0)
    assert parse_ranges(bytes([1, 0, 0])) is None
    assert parse_ranges(bytes([1, 200, 2])) is None


KNOWN = st.sampled_from([0x20, 0x21, 0x23, 0x24, 0x25, 0x26, 0x27, 0x28])
REPORTS = st.one_of(
    st.binary(max_size=64),
    st.builds(lambda report, rest: bytes([report]) + rest, KNOWN, st.binary(max_size=63)),
    st.builds(lambda parts: b"\x23" + radio_message(0, parts), st.binary(min_size=1, max_size=26)),
)


@given(st.lists(REPORTS, max_size=12), st.booleans(), st.booleans())
def test_any_bytes_give_events_or_nothing(reports: list[bytes], old: bool, gen2: bool) -> None:
    reader = DeviceReader(old_radio=old, gen2_light=gen2)
    for report in reports:
        reader.feed(report)
    events = reader.take()
    assert len(events) <= 9 * 16 * len(reports)
    assert len(events.syncs_before) == len(events.sweeps)
    assert (np.diff(events.syncs_before) >= 0).all()
    assert len(reader.take()) == 0
