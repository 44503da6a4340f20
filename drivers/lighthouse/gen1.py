"""Pulses of Gen1 stations -> OOTX bits and angles.

A pulse does not say whose it is: the rhythm of the stations does (gen1_pattern.py). While the
rhythm is known, pulses are taken half-turn by half-turn: those at the expected times and as long as
a flash are flashes, the others sweeps of the one station whose turn it is. How long after that
station's own flash a sensor was hit is the angle.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import Angles, Ints
from lobstr_hw.drivers.lighthouse.gen1_pattern import (
    C_DELAY,
    HALF_TURN,
    LENGTH_OFF,
    SHORTEST,
    Rhythm,
    find_rhythm,
    flash_bit,
    flash_error,
    merge_flashes,
)
from lobstr_hw.drivers.lighthouse.ootx import StationBits

__all__ = ["Gen1Decoder"]

SLICE = 512
"""Pulses taken at a time: what waits is copied at every half-turn."""
MARGIN = 5_000
"""Ticks before its flash at which a half-turn's pulses begin."""
LATE = 20_000
"""Pulses of different reports may come in the wrong order by so much."""
FLASH_LATE, FLASH_OFF = 2_500, 800
"""A flash that starts so much late is a reflection; one this far off its time means doubt."""
SWEEP_TICKS = (30_000, 370_000)
"""After its flash a sweep is in the room; beyond +-76 degrees a station has no light."""
SWEEP_LENGTHS = (50, 10_000)
"""A sensor at the edge of the light has short pulses: 53 ticks were seen to be good."""
MEAN_BELOW, MEAN_ABOVE = 4.0, 3.0
"""Pulses under a quarter and over three times the mean length of a sweep are no part of it."""
SURE, HIT, MISS = 100, 1, 3
AT_FIRST = 20
GIVEN_UP = 240
"""Half-turns (2 s) without a flash after which the rhythm is looked for again."""
MOVES_ALONG = 16
TRIED_EVERY, LOOKED_AT = 16, 512
"""New pulses between two attempts to find the rhythm, and how many are looked at."""
NEWEST_FLASHES = 20


@dataclass(slots=True)
class _Found:
    """What a batch gives, half-turn by half-turn; by station, its bits."""

    angles: list[Angles] = field(default_factory=list)
    told: list[StationBits] = field(default_factory=list)
    bits: dict[int, list[int | None]] = field(default_factory=lambda: {0: [], 1: []})
    fresh: bool = False

    def close(self, fresh: bool) -> None:
        """The bits until now belong together; the next do not belong to them, if ``fresh``."""
        self.told += [
            StationBits(k, tuple(bits), self.fresh) for k, bits in self.bits.items() if bits
        ]
        self.bits, self.fresh = {0: [], 1: []}, fresh


@dataclass(slots=True)
class _Lock:
    """The rhythm, and where in it the next half-turn is.

    ``due``: when each station's next flash begins, by station; ``missed``: how many in a row were.
    """

    rhythm: Rhythm
    due: dict[int, int]
    confidence: int = AT_FIRST
    missed: dict[int, int] = field(default_factory=lambda: {0: 0, 1: 0})


class Gen1Decoder:
    """Angles of one device from the Gen1 stations it sees; how batches are cut is no matter."""

    def __init__(self) -> None:
        """Nothing was seen."""
        self._waiting: Ints = np.zeros((0, 3), dtype=np.int64)
        self._tried = 0
        self._lock: _Lock | None = None

    def decode(self, pulses: Ints) -> tuple[Angles, list[StationBits]]:
        """The hits of a batch and the stations' OOTX bits.

        Args:
            pulses: (n, 3) port, start, length. A half-turn is decoded when pulses of the next are
                there. ``Angles.sensor`` has hardware ports here.
        """
        found = _Found()
        for first in range(0, len(pulses), SLICE):
            self._waiting = np.concatenate([self._waiting, pulses[first : first + SLICE]])
            while self._next(found):
                pass
        found.close(fresh=False)
        return Angles.join(found.angles), found.told

    def _next(self, found: _Found) -> bool:
        """One step; False: more pulses are needed."""
        lock = self._lock
        if lock is None:
            return self._find(found)
        end = lock.rhythm.start + HALF_TURN - MARGIN
        newest = np.maximum.accumulate(self._waiting[:, 1])
        here = int(np.searchsorted(newest, end + LATE))
        if here == len(newest):
            return False
        head, rest = self._waiting[: here + 1], self._waiting[here + 1 :]
        before = head[:, 1] < end
        self._waiting = np.concatenate([head[~before], rest])
        _half_turn(lock, head[before & (head[:, 1] >= end - HALF_TURN)], found)
        if lock.confidence < 0 or min(lock.missed[k] for k in lock.due) > GIVEN_UP:
            self._lock, self._tried = None, 0
            # or else pulses in the wrong order could make the same rhythm be found again for ever
            self._waiting = self._waiting[self._waiting[:, 1] >= end]
        return True

    def _find(self, found: _Found) -> bool:
        """Look for the rhythm among the pulses that wait, a few more at a time."""
        if len(self._waiting) < self._tried + TRIED_EVERY:
            return False
        self._tried += TRIED_EVERY
        seen = self._waiting[: self._tried]
        ordered = seen[np.argsort(seen[:, 1], kind="stable")]
        flashes = merge_flashes([(int(s), int(n)) for _, s, n in ordered])[-NEWEST_FLASHES:]
        rhythm = find_rhythm(flashes)
        if rhythm is None:
            self._waiting = self._waiting[max(0, self._tried - LOOKED_AT) :]
            self._tried = min(self._tried, LOOKED_AT)
            return True
        self._lock = _lock_at(rhythm, flashes[0].start)
        self._tried = 0
        found.close(fresh=True)
        return True


def _lock_at(rhythm: Rhythm, first: int) -> _Lock:
    """The lock at the half-turn of the first flash."""
    turns = (first + MARGIN - rhythm.start) // HALF_TURN
    start = rhythm.start + turns * HALF_TURN
    at = Rhythm(rhythm.alone, (rhythm.half + turns) % rhythm.halves, start)
    return _Lock(at, {0: start} if at.alone else {1: start, 0: start + C_DELAY})


def _half_turn(lock: _Lock, pulses: Ints, found: _Found) -> None:
    """Take the pulses of one half-turn, and go to the next."""
    rhythm, due = lock.rhythm, lock.due
    starts, lengths = pulses[:, 1], pulses[:, 2]
    seen: dict[int, int] = {}
    free = np.ones(len(pulses), dtype=bool)
    for station, when in due.items():
        near = (starts >= when - MARGIN) & (starts < when + FLASH_LATE) & free
        flash = near & (lengths >= SHORTEST)
        free &= ~near
        bit = None
        if flash.any():
            start, length = int(starts[flash].min()), int(lengths[flash].max())
            off = flash_error(length, rhythm.axis, rhythm.skips(station))
            if abs(start - when) < FLASH_OFF and off < LENGTH_OFF:
                seen[station] = start
                bit = flash_bit(length, rhythm.axis, rhythm.skips(station))
            lock.confidence += HIT if station in seen else -MISS
        found.bits[station].append(bit)
    lock.confidence = min(lock.confidence, SURE)
    flashes = _predicted(lock, seen)
    found.angles.append(_sweep(rhythm, pulses[free], flashes[rhythm.sweeping]))
    lock.due = {station: start + HALF_TURN for station, start in flashes.items()}
    lock.rhythm = rhythm.next(min(lock.due.values()))


def _predicted(lock: _Lock, seen: dict[int, int]) -> dict[int, int]:
    """When each flash began: one that was missed is where it was due.

    The stations' clocks and the device's differ by some 30 ppm, 10 ticks a half-turn: one that is
    out of sight for long moves along with the other.
    """
    late = [start - lock.due[station] for station, start in seen.items()]
    flashes = {}
    for station, due in lock.due.items():
        lock.missed[station] = 0 if station in seen else lock.missed[station] + 1
        moved = late[0] if late and lock.missed[station] > MOVES_ALONG else 0
        flashes[station] = seen.get(station, due + moved)
    return flashes


def _sweep(rhythm: Rhythm, pulses: Ints, flash: int) -> Angles:
    """The angles of one sweep: the longest pulse of every sensor, if it is like the others."""
    passed = pulses[:, 1] + pulses[:, 2] // 2 - flash
    good = (passed > SWEEP_TICKS[0]) & (passed < SWEEP_TICKS[1])
    good &= (pulses[:, 2] >= SWEEP_LENGTHS[0]) & (pulses[:, 2] < SWEEP_LENGTHS[1])
    pulses, passed = pulses[good], passed[good]
    longest = np.lexsort((-pulses[:, 2], pulses[:, 0]))
    _, first = np.unique(pulses[longest, 0], return_index=True)
    pulses, passed = pulses[longest[first]], passed[longest[first]]
    mean = pulses[:, 2].mean() if len(pulses) else 0.0
    like = (pulses[:, 2] * MEAN_BELOW >= mean) & (pulses[:, 2] <= MEAN_ABOVE * mean)
    pulses, passed = pulses[like], passed[like]
    same = np.ones(len(pulses), dtype=np.int64)
    return Angles(
        ticks=pulses[:, 1],
        station=rhythm.sweeping * same,
        axis=rhythm.axis * same,
        sensor=pulses[:, 0],
        angle_rad=np.float64(math.pi / HALF_TURN) * passed - math.pi / 2,
    )
