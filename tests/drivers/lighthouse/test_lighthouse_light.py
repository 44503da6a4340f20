"""Light of base stations, made here by their rules, decoded to angles, bits and calibrations."""

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lobstr_hw.drivers.lighthouse import gen1
from lobstr_hw.drivers.lighthouse.angles import Angles, Ints, StationCalibration
from lobstr_hw.drivers.lighthouse.gen1 import Gen1Decoder
from lobstr_hw.drivers.lighthouse.gen1_pattern import Flash, Rhythm, find_rhythm
from lobstr_hw.drivers.lighthouse.gen2 import PERIODS, Gen2Decoder
from lobstr_hw.drivers.lighthouse.ootx import GEN1_PAYLOAD, GEN2_PAYLOAD, OotxReader, StationBits
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.reprojection import reproject
from lobstr_hw.drivers.lighthouse.station_message import parse_station
from lobstr_hw.rotations import Array

HALF_TURN = 400_000


def frame_bits(payload: bytes) -> list[int]:
    """An OOTX frame as a station sends it."""
    data = struct.pack("<H", len(payload)) + payload + b"\0" * (len(payload) % 2)
    data += struct.pack("<I", zlib.crc32(payload))
    digits = "".join(f"{byte:08b}" for byte in data)
    words = [digits[k : k + 16] + "1" for k in range(0, len(digits), 16)]
    return [int(bit) for bit in "0" * 17 + "1" + "".join(words)]


def no_events() -> dict[str, Ints]:
    widths = {"imu": 7, "pulses": 3, "syncs": 4, "sweeps": 4}
    tables = {name: np.zeros((0, width), dtype=np.int64) for name, width in widths.items()}
    return tables | {"syncs_before": np.zeros(0, dtype=np.int64)}


def gen1_pulses(
    turns: int, angles: Array, seen: tuple[int, ...] = (0, 1), seed: int = 1
) -> tuple[Ints, Ints]:
    """Pulses of two stations, and the (station, axis, sensor, ticks) of every sweep's hit.

    ``angles`` (2, 2, s): by station, axis and sensor.
    """
    rng = np.random.default_rng(seed)
    pulses, hits = [], []
    for half in range(turns * 4):
        start, axis = 10_000_000 + half * HALF_TURN, half % 2
        sweeping = 0 if half % 4 < 2 else 1
        flashes = {1: start, 0: start + 20_000}
        for station in seen:
            data = int(rng.integers(2))
            late = [int(rng.integers(90)) for _ in range(angles.shape[2])]
            length = 2_750 + 500 * axis + 1_000 * data + 2_000 * (station != sweeping)
            pulses += [
                (sensor, flashes[station] + by, length - by + int(rng.integers(-60, 60)))
                for sensor, by in enumerate(late)
            ]
            own = min(p[1] for p in pulses[-angles.shape[2] :])
            if station != sweeping:
                continue
            for sensor, angle in enumerate(angles[station, axis]):
                middle = own + round((angle + math.pi / 2) * HALF_TURN / math.pi)
                length = 2 * int(rng.integers(100, 180))
                pulses.append((sensor, middle - length // 2, length))
                hits.append((station, axis, sensor, middle - length // 2))
    return np.array(pulses), np.array(hits)


def cut(count: int, places: list[int]) -> Iterator[slice]:
    edges = sorted({0, count, *(place % (count + 1) for place in places)})
    yield from (slice(a, b) for a, b in pairwise(edges))


GEN1_ANGLES = np.random.default_rng(5).uniform(-0.9, 0.9, (2, 2, 6))


def rows(angles: Angles) -> list[tuple[int, ...]]:
    columns = np.stack([angles.station, angles.axis, angles.sensor, angles.ticks], axis=1)
    return sorted(map(tuple, columns.tolist()))


@pytest.mark.parametrize("seen", [(0, 1), (0,), (1,)])
def test_gen1_sweeps_become_the_angles_they_were_made_of(seen: tuple[int, ...]) -> None:
    pulses, hits = gen1_pulses(40, GEN1_ANGLES, seen)
    angles, _ = Gen1Decoder().decode(pulses)
    found = rows(angles)
    assert set(found) <= set(map(tuple, hits.tolist()))
    assert len(found) >= len(hits) - 2 * 2 * 6  # the last half-turns still wait
    true = GEN1_ANGLES[angles.station, angles.axis, angles.sensor]
    np.testing.assert_allclose(angles.angle_rad, true, atol=math.pi / HALF_TURN)


@settings(max_examples=25)
@given(st.lists(st.integers(0, 10**6), max_size=30))
def test_gen1_angles_do_not_depend_on_how_batches_are_cut(places: list[int]) -> None:
    pulses, _ = gen1_pulses(12, GEN1_ANGLES)
    whole, told = Gen1Decoder().decode(pulses)
    decoder = Gen1Decoder()
    parts = [decoder.decode(pulses[part]) for part in cut(len(pulses), places)]
    joined = Angles.join([angles for angles, _ in parts])
    for name in Angles.__slots__:
        np.testing.assert_array_equal(getattr(joined, name), getattr(whole, name))
    assert _bits([b for _, batch in parts for b in batch]) == _bits(told)


def _bits(told: list[StationBits]) -> dict[int, list[tuple[int | None, ...]]]:
    """By station, its bits in runs that belong together."""
    runs: dict[int, list[tuple[int | None, ...]]] = {}
    for bits in told:
        station = runs.setdefault(bits.station, [()])
        if bits.fresh and station[-1]:
            station.append(())
        station[-1] += bits.bits
    return runs


def test_gen1_reflections_and_noise_are_not_taken_for_stations() -> None:
    rng = np.random.default_rng(2)
    starts = np.sort(rng.integers(0, 10**9, 5_000))
    ports, lengths = rng.integers(0, 24, 5_000), rng.integers(50, 7_000, 5_000)
    noise = np.stack([ports, starts, lengths], axis=1)
    angles, told = Gen1Decoder().decode(noise)
    assert len(angles) == 0
    assert not any(bits.bits for bits in told)


@pytest.mark.parametrize("seed", [13, 66, 159])
def test_found_and_lost_the_rhythm_uses_pulses_up(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some pulses have times of elsewhere, so that a rhythm is found and at once lost again."""
    calls = []

    def counted(flashes: Sequence[Flash]) -> Rhythm | None:
        calls.append(len(flashes))
        assert len(calls) < 1_000, "the same rhythm is found again and again"
        return find_rhythm(flashes)

    monkeypatch.setattr(gen1, "find_rhythm", counted)
    rng = np.random.default_rng(seed)
    pulses, _ = gen1_pulses(int(rng.integers(4, 14)), GEN1_ANGLES, seed=seed)
    spread = 10 ** int(rng.integers(4, 9))
    astray = rng.random(len(pulses)) < rng.choice([0.02, 0.1, 0.3])
    pulses[astray, 1] += rng.integers(-spread, spread, astray.sum())
    order = np.arange(len(pulses))
    if rng.random() < 0.5:
        order = np.argsort(pulses[:, 1] + rng.integers(0, spread, len(pulses)))
    angles, _ = Gen1Decoder().decode(pulses[order])
    assert len(angles) <= len(pulses)


def test_gen1_goes_on_after_the_light_was_away() -> None:
    early, _ = gen1_pulses(20, GEN1_ANGLES)
    late, hits = gen1_pulses(20, GEN1_ANGLES)
    away = 10 * 48_000_000 + 123_456
    late[:, 1] += away
    decoder = Gen1Decoder()
    decoder.decode(early)
    angles, _ = decoder.decode(late)
    good = angles.ticks > away
    true = GEN1_ANGLES[angles.station, angles.axis, angles.sensor]
    assert good.sum() > 0.8 * len(hits)
    np.testing.assert_allclose(angles.angle_rad[good], true[good], atol=2e-5)


def gen2_events(
    turns: int, angles: Array, missed: frozenset[int] = frozenset(), bits: tuple[int, ...] = (1, 0)
) -> RawEvents:
    """Words of one station per channel in ``angles`` (channel -> (2, s))."""
    tables = no_events()
    words: list[tuple[int, ...]] = []
    for channel, of_channel in enumerate(angles):
        period = PERIODS[channel] + 7
        for turn in range(turns):
            start = 5_000_000 + turn * period + 1_000 * channel
            if turn not in missed:
                words.append((start, 0, channel, bits[turn % len(bits)], 0))
            for plane, of_plane in enumerate(of_channel):
                for sensor, angle in enumerate(of_plane):
                    after = (angle + (1 + plane) * 2 * math.pi / 3) / (2 * math.pi) * period
                    halves = round(2 * after)
                    words.append((start + halves // 2, 1, channel, sensor, halves % 2))
    words.sort()
    syncs = [(c, t, bit, 0) for t, sweep, c, bit, _ in words if not sweep]
    sweeps = [(c, s, t, half) for t, sweep, c, s, half in words if sweep]
    before = np.cumsum([not word[1] for word in words])[[bool(word[1]) for word in words]]
    tables |= {"syncs": np.array(syncs), "sweeps": np.array(sweeps), "syncs_before": before}
    return RawEvents(**tables)


GEN2_ANGLES = np.random.default_rng(6).uniform(-0.8, 0.8, (3, 2, 5))


def test_gen2_sweeps_become_the_angles_they_were_made_of_even_after_a_missed_sync() -> None:
    events = gen2_events(50, GEN2_ANGLES, missed=frozenset({20, 21, 33}))
    angles, _ = Gen2Decoder().decode(events)
    assert len(angles) == len(events.sweeps)
    true = GEN2_ANGLES[angles.station, angles.axis, angles.sensor]
    late = 4 * 7 / min(PERIODS) * 2 * math.pi  # the first turns have the period of the book
    np.testing.assert_allclose(angles.angle_rad, true, atol=late)
    assert np.median(np.abs(angles.angle_rad - true)) < 4e-6


@settings(max_examples=25)
@given(st.lists(st.integers(0, 10**6), max_size=30))
def test_gen2_angles_do_not_depend_on_how_batches_are_cut(places: list[int]) -> None:
    events = gen2_events(30, GEN2_ANGLES)
    whole, told = Gen2Decoder().decode(events)
    decoder = Gen2Decoder()
    parts = []
    for part in cut(len(events.sweeps), places):
        # the syncs before the part's last sweep that no part before had
        done = int(events.syncs_before[part.start - 1]) if part.start else 0
        ends = len(events.syncs) if part.stop == len(events.sweeps) else 0
        last = max(int(events.syncs_before[part.stop - 1]), ends)
        tables = no_events() | {
            "syncs": events.syncs[done:last],
            "sweeps": events.sweeps[part],
            "syncs_before": events.syncs_before[part] - done,
        }
        parts.append(decoder.decode(RawEvents(**tables)))
    joined = Angles.join([angles for angles, _ in parts])
    for name in Angles.__slots__:
        np.testing.assert_array_equal(getattr(joined, name), getattr(whole, name))
    assert _bits([b for _, batch in parts for b in batch]) == _bits(told)


def test_gen2_planes_are_told_apart_by_their_own_past_where_both_could_be_meant() -> None:
    """A sensor that goes slowly out to 68 degrees is beyond half a turn, and still of plane 0."""
    angle = np.linspace(0.75, math.radians(68), 60)
    period = PERIODS[0]
    tables = no_events()
    turns = np.arange(60)
    starts = 1_000_000 + turns * period
    after = np.round((angle + 2 * math.pi / 3) / (2 * math.pi) * period).astype(np.int64)
    zeros = np.zeros(60, dtype=np.int64)
    tables["syncs"] = np.stack([zeros, starts, zeros, zeros], axis=1)
    tables["sweeps"] = np.stack([zeros, zeros, starts + after, zeros], axis=1)
    tables["syncs_before"] = turns + 1
    angles, _ = Gen2Decoder().decode(RawEvents(**tables))
    assert angles.axis.tolist() == [0] * 60
    np.testing.assert_allclose(angles.angle_rad, angle, atol=1e-5)


def test_a_sync_that_fits_no_turn_is_ignored() -> None:
    events = gen2_events(20, GEN2_ANGLES[:1])
    clean, _ = Gen2Decoder().decode(events)
    stray = np.array([[0, events.syncs[9, 1] + 300_000, 1, 0]])
    tables = {name: getattr(events, name) for name in RawEvents.__slots__}
    tables["syncs"] = np.insert(events.syncs, 10, stray, axis=0)
    tables["syncs_before"] = events.syncs_before + (events.syncs_before >= 10)
    dirty, _ = Gen2Decoder().decode(RawEvents(**tables))
    np.testing.assert_allclose(dirty.angle_rad, clean.angle_rad)


PAYLOADS = st.sampled_from([GEN1_PAYLOAD, GEN2_PAYLOAD]).flatmap(
    lambda n: st.binary(min_size=n, max_size=n)
)


@given(PAYLOADS, st.integers(0, 1_000), st.data())
def test_a_frame_is_read_from_any_bit_on(payload: bytes, first: int, data: st.DataObject) -> None:
    bits = frame_bits(payload)
    if "0" * 17 + "1" in "".join(map(str, bits[1:] + bits[:17])):
        return  # such a payload would not be sent: its middle looks like a beginning
    first %= len(bits)
    stream = (bits * 3)[first : first + len(bits) + 16]
    assert OotxReader(len(payload)).feed(stream) == payload


@given(PAYLOADS, st.integers(0, 442), st.sets(st.integers(0, 442), max_size=10))
def test_missing_bits_follow_from_the_crc_or_come_again(
    payload: bytes, first: int, missing: set[int]
) -> None:
    bits = frame_bits(payload)
    begin = first % len(bits)
    once: list[int | None] = [None if k in missing else b for k, b in enumerate(bits)]
    found = OotxReader(len(payload)).feed((once * 2)[begin : begin + len(bits) + 16])
    assert found in (None, payload)
    again = (once + list[int | None](bits) * 2)[begin:]
    if bytes(17) + b"\1" not in bytes(bits[1:] + bits[:17]):
        assert OotxReader(len(payload)).feed(again) == payload


@given(PAYLOADS, st.integers(0, 10_000))
def test_a_wrong_bit_never_gives_a_wrong_payload(payload: bytes, place: int) -> None:
    """It comes first, so that no part of the frame is without it; padding alone has no CRC."""
    bits = frame_bits(payload)
    place %= len(bits)
    bits[place] ^= 1
    found = OotxReader(len(payload)).feed(bits[place:] + bits[:place])
    padding = 18 + (2 + len(payload)) * 8 // 16 * 17 + 8
    assert found is None or (found == payload and padding <= place < padding + 8)


@given(st.lists(st.sampled_from([0, 1, None]), max_size=1_500))
def test_any_bits_are_no_frame(bits: list[int | None]) -> None:
    assert OotxReader(GEN2_PAYLOAD).feed(bits) is None


def station_payload(generation: int, **numbers: float) -> bytes:
    """A payload with these floats by name, else zeros."""
    n = {name: numbers.get(name, 0.0) for name in ("p0", "p1", "t0", "t1", "c0", "c1", "g0", "g1")}
    head = struct.pack("<HI4eBB", 6, 0xBEC08E38, n["p0"], n["p1"], n["t0"], n["t1"], 3, 9)
    middle = struct.pack("<2e3b", n["c0"], n["c1"], 0, 127, 0)
    middle += struct.pack("<4eBB", n["g0"], n["g1"], 0.25, -0.5, 1, 0)
    return (
        head + middle + (struct.pack("<4eH", 1.0, 2.0, -0.25, 0.5, 7) if generation == 2 else b"")
    )


def test_a_station_message_is_read_by_its_table() -> None:
    numbers = {"p0": 0.5, "p1": -0.25, "t0": 0.125, "t1": -0.5, "c0": 0.75, "g0": 3.0, "g1": -1.0}
    first = parse_station(station_payload(1, **numbers))
    second = parse_station(station_payload(2, **numbers))
    assert first is not None
    assert second is not None
    for station in (first, second):
        assert (station.id, station.mode, station.unlock_count) == (0xBEC08E38, 1, 3)
        np.testing.assert_array_equal(station.up, [0, 1, 0])
        np.testing.assert_array_equal(station.phase, [0.5, -0.25])
        np.testing.assert_array_equal(station.curve, [0.75, 0])
        np.testing.assert_array_equal(station.gibphase, [3, -1])
        np.testing.assert_array_equal(station.gibmag, [0.25, -0.5])
    np.testing.assert_array_equal(first.tilt, np.tan([0.125, -0.5]))
    np.testing.assert_array_equal(second.tilt, [0.125, -0.5])
    np.testing.assert_array_equal(second.ogeephase, [1, 2])
    np.testing.assert_array_equal(second.ogeemag, [-0.25, 0.5])


@given(st.one_of(st.binary(max_size=50), PAYLOADS))
def test_any_payload_is_a_believable_station_or_none(payload: bytes) -> None:
    station = parse_station(payload)
    if station is not None:
        assert np.isfinite(reproject(station, np.array([0.1, 0.2, -2.0]))).all()


@pytest.mark.parametrize("generation", [1, 2])
def test_straight_ahead_of_an_ideal_station_both_angles_are_zero(generation: int) -> None:
    angles = reproject(StationCalibration(generation), np.array([[0.0, 0.0, -1.0], [0, 0, -7]]))
    np.testing.assert_allclose(angles, 0, atol=1e-12)


@given(st.floats(-1, 1), st.floats(-0.5, 0.5), st.floats(0.5, 5), st.floats(0.5, 4))
def test_a_point_further_out_on_the_same_ray_has_the_same_angles(
    x: float, y: float, depth: float, factor: float
) -> None:
    calibration = StationCalibration(
        2, phase=np.array([0.01, -0.02]), tilt=np.array([0.05, -0.05]), ogeemag=np.array([0.1, 0.2])
    )
    point = np.array([x, y, -1.0]) * depth
    for station in (calibration, StationCalibration(1, curve=np.array([0.01, 0.02]))):
        near, far = reproject(station, np.stack([point, factor * point]))
        np.testing.assert_allclose(near, far, atol=1e-12)


@given(st.floats(-1.2, 1.2))
def test_in_the_horizontal_plane_ideal_angles_are_the_bearing(bearing: float) -> None:
    point = np.array([math.sin(bearing), 0.0, -math.cos(bearing)])
    first, second = (reproject(StationCalibration(g), point) for g in (1, 2))
    np.testing.assert_allclose(first[0], -bearing, atol=1e-12)
    np.testing.assert_allclose(second, -bearing, atol=1e-12)


WHEN = st.one_of(st.integers(0, 2**26), st.integers(0, 2**50))
PULSES = st.lists(st.tuples(st.integers(0, 255), WHEN, st.integers(0, 65_535)), max_size=80)
SYNCS = st.lists(st.tuples(st.integers(0, 15), WHEN, *[st.integers(0, 1)] * 2), max_size=40)
SWEEPS = st.lists(
    st.tuples(st.integers(0, 15), st.integers(0, 31), WHEN, st.integers(0, 1)), max_size=40
)


@given(PULSES, SYNCS, SWEEPS, st.data())
def test_any_events_give_angles_of_a_half_turn_or_nothing(
    pulses: list[tuple[int, ...]],
    syncs: list[tuple[int, ...]],
    sweeps: list[tuple[int, ...]],
    data: st.DataObject,
) -> None:
    places = st.lists(st.integers(0, len(syncs)), min_size=len(sweeps), max_size=len(sweeps))
    events = RawEvents(
        imu=np.zeros((0, 7), dtype=np.int64),
        pulses=np.array(pulses, dtype=np.int64).reshape(-1, 3),
        syncs=np.array(syncs, dtype=np.int64).reshape(-1, 4),
        sweeps=np.array(sweeps, dtype=np.int64).reshape(-1, 4),
        syncs_before=np.array(sorted(data.draw(places)), dtype=np.int64),
    )
    one, _ = Gen1Decoder().decode(events.pulses)
    two, _ = Gen2Decoder().decode(events)
    assert len(one) <= len(pulses)
    assert len(two) <= len(sweeps)
    assert (np.abs(one.angle_rad) < math.pi / 2).all()
    assert (np.abs(two.angle_rad) <= 4 * math.pi / 3).all()
