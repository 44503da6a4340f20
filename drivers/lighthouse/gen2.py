"""Syncs and sweeps of Gen2 stations -> OOTX bits and angles.

A station turns about 50 times a second, each channel a little differently. Once a turn the device
gets a sync with one OOTX bit; two planes of light, tilted by +-30 degrees and a third of a turn
apart, sweep the room. How far the rotor has turned since the sync is the angle.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, Ints
from lobstr_hw.drivers.lighthouse.ootx import StationBits
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.rotations import Array

__all__ = ["PERIODS", "Gen2Decoder"]

# fmt: off
PERIODS = (
    959_000, 957_000, 953_000, 949_000, 947_000, 943_000, 941_000, 939_000,
    937_000, 929_000, 919_000, 911_000, 907_000, 901_000, 893_000, 887_000,
)
# fmt: on
"""Ticks of a turn, by channel; real ones are off by 50 ticks at most."""
OFF_BY_HZ = 1.0
MOST_TURNS = 10
"""Turns after which a sync is too old to measure angles from."""
FORGOTTEN_TURNS = 1500
"""Turns (30 s) without a sync after which nobody can count them: periods are off by 50 ppm."""
RESTARTED_TURNS = 0.2
"""A sync this far from a whole number of turns, after a gap: the station began anew."""
THIRD = 2 * math.pi / 3
UNSURE = 0.1 * math.pi
"""So close to half a turn both planes can be meant (at +60 and at -60 degrees)."""
BLIND = 0.05 * math.pi
"""So close to it a plane cannot be guessed."""
NEAR_RAD = 0.1
RECENT_TICKS = TICKS_PER_S // 10


@dataclass(slots=True)
class _Station:
    """What is known of one channel."""

    channel: int
    start: int | None = None
    period: float = 0.0
    recent: list[tuple[int, float] | None] = field(default_factory=lambda: [None, None])

    def turn(self, ticks: int) -> int | None:
        """A sync came: how many turns after the last one; 0: it begins anew, None: it is none."""
        nominal = float(PERIODS[self.channel])
        passed = FORGOTTEN_TURNS * nominal if self.start is None else float(ticks - self.start)
        turns = round(passed / nominal)
        slipped = turns > MOST_TURNS and abs(passed / nominal - turns) > RESTARTED_TURNS
        if passed <= 0 or turns >= FORGOTTEN_TURNS or slipped:
            self.start, self.period = ticks, nominal
            return 0
        if abs(turns / passed - 1 / nominal) * TICKS_PER_S > OFF_BY_HZ:
            return None
        self.start, self.period = ticks, passed / turns
        return turns


class Gen2Decoder:
    """Angles of one device from all Gen2 stations it sees; how batches are cut is no matter."""

    def __init__(self) -> None:
        """No station was seen."""
        self._stations: dict[int, _Station] = {}

    def decode(self, events: RawEvents) -> tuple[Angles, list[StationBits]]:
        """The hits of a batch, and the OOTX bits of every station.

        Hits that cannot be told apart, or without a recent sync, are left out. ``Angles.sensor``
        has hardware ports here; ``decoding.DeviceDecoder`` knows whose they are.
        """
        parts: list[tuple[Ints, Ints, Array]] = []
        turns: list[StationBits] = []
        for channel in np.unique(np.concatenate([events.syncs[:, 0], events.sweeps[:, 0]])):
            station = self._stations.setdefault(int(channel), _Station(int(channel)))
            rows = np.flatnonzero(events.sweeps[:, 0] == channel)
            told, turned = _turned(station, events, rows)
            turns += told
            good = (turned >= 0) & (turned < MOST_TURNS)
            rows, turned = rows[good], 2 * math.pi * (turned[good] % 1.0)
            planes = _planes(station, events.sweeps[rows, 2], turned)
            kept = planes >= 0
            rows, planes, turned = rows[kept], planes[kept], turned[kept]
            parts.append((rows, planes, turned - THIRD * (1 + planes)))
        return _join(events, parts), turns


def _turned(station: _Station, events: RawEvents, rows: Ints) -> tuple[list[StationBits], Array]:
    """A station's bits, and how many turns after its last sync each of its sweeps was."""
    start, period = station.start, station.period
    syncs, told = _take_turns(station, events.syncs)
    starts = np.array([math.nan if start is None else start, *syncs[:, 1]])
    periods = np.array([period or math.nan, *syncs[:, 2]])
    last = np.searchsorted(syncs[:, 0], events.syncs_before[rows], side="left")
    ticks = events.sweeps[rows, 2] + events.sweeps[rows, 3] / 2
    return told, (ticks - starts[last]) / periods[last]


def _take_turns(station: _Station, syncs: Ints) -> tuple[Array, list[StationBits]]:
    """A station's syncs of a batch: (n, 3) place in the batch, start, period; and their bits."""
    rows: list[tuple[float, float, float]] = []
    told: list[StationBits] = []
    bits: list[int | None] = []
    fresh = False
    for at in np.flatnonzero(syncs[:, 0] == station.channel):
        turns = station.turn(int(syncs[at, 1]))
        if turns is None:
            continue
        if turns == 0:
            told += [StationBits(station.channel, tuple(bits), fresh)] if bits else []
            bits, fresh = [], True
        bits += [None] * (turns - 1) + [int(syncs[at, 2])]
        rows.append((float(at), float(syncs[at, 1]), station.period))
    told += [StationBits(station.channel, tuple(bits), fresh)] if bits else []
    return np.array(rows).reshape(-1, 3), told


def _planes(station: _Station, ticks: Ints, turned: Array) -> Ints:
    """Which plane hit; -1: nobody knows. Near half a turn the latest hits of each plane decide."""
    planes = np.where(turned < math.pi, 0, 1)
    seen = 0
    for at in np.flatnonzero(np.abs(turned - math.pi) < UNSURE).tolist():
        _remember(station, ticks[seen:at], planes[seen:at], turned[seen:at])
        planes[at] = _guess(station, int(ticks[at]), float(turned[at]))
        seen = at
    _remember(station, ticks[seen:], planes[seen:], turned[seen:])
    return planes


def _remember(station: _Station, ticks: Ints, planes: Ints, turned: Array) -> None:
    for plane in (0, 1):
        hits = np.flatnonzero(planes == plane)
        if len(hits):
            station.recent[plane] = (int(ticks[hits[-1]]), float(turned[hits[-1]]))


def _guess(station: _Station, ticks: int, turned: float) -> int:
    far = [
        abs(turned - last[1]) if last and abs(ticks - last[0]) < RECENT_TICKS else math.inf
        for last in station.recent
    ]
    if min(far) < NEAR_RAD:
        return far.index(min(far))
    if abs(turned - math.pi) < BLIND:
        return -1
    return 0 if turned < math.pi else 1


def _join(events: RawEvents, parts: list[tuple[Ints, Ints, Array]]) -> Angles:
    """The hits of all stations, in the order in which the device told them."""
    if not parts:
        return Angles.join([])
    rows, planes, angles = (np.concatenate([part[k] for part in parts]) for k in range(3))
    order = np.argsort(rows, kind="stable")
    sweeps = events.sweeps[rows[order]]
    return Angles(sweeps[:, 2], sweeps[:, 0], planes[order], sweeps[:, 1], angles[order])
