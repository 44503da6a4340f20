"""The rhythm of Gen1 base stations: which flash means what, and finding the place in it.

Two stations share one rhythm of four half-turns of 400 000 ticks (8.3 ms). Each begins with a flash
of station 1 (mode B), 20 000 ticks later one of station 0 (mode C); then one of them sweeps:

    half-turn   0   station 0 sweeps, axis 0       2   station 1 sweeps, axis 0
                1   station 0 sweeps, axis 1       3   station 1 sweeps, axis 1

One station alone (mode A, here station 0) sweeps in every half-turn, axis 0, axis 1, and so on.

The length of a flash says axis, data bit and whether its station skips this sweep:
3000 + 500 axis + 1000 data + 2000 skip is the most that it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Flash", "Rhythm", "find_rhythm", "flash_bit", "flash_error", "merge_flashes"]

HALF_TURN, C_DELAY = 400_000, 20_000
SHORTEST, LONGEST = 2_250, 6_800
"""Ticks of a flash, a good sensor's and a poor one's; sweeps far from a station are shorter."""
TIME_OFF, LENGTH_OFF = 700, 550
"""How far a flash may be off its place and its length: the stations drift, sensors differ."""
ENOUGH = 12
"""Flashes that must agree; a tenth of a second."""
SHARE = 0.75


@dataclass(frozen=True, slots=True)
class Flash:
    """One flash, seen by any number of sensors: earliest start, longest length."""

    start: int
    length: int


@dataclass(frozen=True, slots=True)
class Rhythm:
    """A place in the rhythm: half-turn ``half`` begins at ``start``, with the first flash."""

    alone: bool
    half: int
    start: int

    @property
    def halves(self) -> int:
        """Half-turns after which all begins anew."""
        return 2 if self.alone else 4

    @property
    def axis(self) -> int:
        """Which axis is swept in this half-turn."""
        return self.half % 2

    @property
    def sweeping(self) -> int:
        """The station that sweeps in this half-turn."""
        return 0 if self.alone or self.half < 2 else 1

    def skips(self, station: int) -> bool:
        """Whether a station only flashes in this half-turn."""
        return station != self.sweeping

    def next(self, start: int) -> "Rhythm":
        """The half-turn after this one, which begins at ``start``."""
        return Rhythm(self.alone, (self.half + 1) % self.halves, start)


def flash_length(axis: int, data: int, skip: bool) -> int:
    """The middle of the lengths that such a flash has."""
    return 2_750 + 500 * axis + 1_000 * data + 2_000 * skip


def flash_bit(length: int, axis: int, skip: bool) -> int:
    """The data bit of a flash whose other meanings are known."""
    return int(length > (flash_length(axis, 0, skip) + flash_length(axis, 1, skip)) // 2)


def flash_error(length: int, axis: int, skip: bool) -> int:
    """How far a length is off the nearer of the two that would be right."""
    return abs(length - flash_length(axis, flash_bit(length, axis, skip), skip))


def merge_flashes(pulses: Sequence[tuple[int, int]]) -> list[Flash]:
    """Pulses (start, length), by their start, that overlap and are as long as a flash: one."""
    flashes: list[Flash] = []
    for start, length in pulses:
        if not SHORTEST <= length <= LONGEST:
            continue
        last = flashes[-1] if flashes else None
        if last is not None and start < last.start + last.length:
            flashes[-1] = Flash(last.start, max(last.length, length))
        else:
            flashes.append(Flash(start, length))
    return flashes


def find_rhythm(flashes: Sequence[Flash]) -> Rhythm | None:
    """The place in the rhythm of the newest half-turn that fits what was seen, if enough does."""
    if len(flashes) < ENOUGH:
        return None
    best, hits = None, 0
    for anchor in flashes[-4:]:  # one of four may be no flash at all
        for rhythm in _hypotheses(anchor.start):
            found = sum(_agrees(rhythm, flash) for flash in flashes)
            if found > hits:
                best, hits = rhythm, found
    return best if hits >= max(ENOUGH, SHARE * len(flashes)) else None


def _hypotheses(start: int) -> list[Rhythm]:
    """Every meaning that a flash could have."""
    both = [Rhythm(False, half, start - delay) for half in range(4) for delay in (0, C_DELAY)]
    return both + [Rhythm(True, half, start) for half in range(2)]


def _agrees(rhythm: Rhythm, flash: Flash) -> bool:
    turns, rest = divmod(flash.start - rhythm.start + TIME_OFF, HALF_TURN)
    then = Rhythm(rhythm.alone, (rhythm.half + turns) % rhythm.halves, 0)
    delay = rest - TIME_OFF
    if abs(delay) < TIME_OFF:
        station = 0 if rhythm.alone else 1
    elif abs(delay - C_DELAY) < TIME_OFF and not rhythm.alone:
        station = 0
    else:
        return False
    return flash_error(flash.length, then.axis, then.skips(station)) < LENGTH_OFF
