"""Finding out where the base stations stand: what to tell the person, and when there is enough.

Pure: light and calibrations go in; words, and at times a request to solve, come out. Solving takes
seconds and is done elsewhere (station_desk.py).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from lobstr_hw.drivers.lighthouse.angles import DeviceModel, StationCalibration
from lobstr_hw.drivers.lighthouse.decoding import Decoded
from lobstr_hw.drivers.lighthouse.station_solve import StationSolution
from lobstr_hw.drivers.lighthouse.station_views import Take
from lobstr_hw.drivers.lighthouse.survey_take import SurveyTake

__all__ = ["SolveRequest", "Survey", "station_name"]

ENOUGH_SEEN, ENOUGH_TOGETHER = 16, 8
"""Quarters of a second in which each station was in view of a moving device; and with another."""
ENOUGH_MOVING = 48
"""Of moving in all: twelve seconds usually tell up to a quarter of a degree."""
MORE = 20
"""So many more before the next try."""
TOLD_EVERY = 12
RESIDUAL_RAD = 1e-3
"""A few tenths are usual."""
UP_RAD, UP_AT_LAST_RAD = 0.005, 0.02
"""How well up should be known; and what has to do when 35 s of moving did not tell it better."""
AT_LAST = 160
ALONE = 120
"""Half a minute of moving without a sight of any station whose place is known: there is none."""

FIRST_WORDS = (
    "Where your base stations stand is not known yet. Lay one tracker still on the floor, in sight "
    "of all base stations, and leave it there until you are told more."
)
CARRY = (
    "Now carry a tracker slowly through the room, turning it every way, for at least twelve "
    "seconds and until the base stations are found; all of them should see it at once now and then."
)


def station_name(calibration: StationCalibration) -> str:
    """As printed on its back."""
    return f"LHB-{calibration.id:08X}"


@dataclass(frozen=True, slots=True, eq=False)
class SolveRequest:
    """There is enough to solve with."""

    takes: Sequence[Take]
    calibrations: Mapping[int, StationCalibration]


class Survey:
    """Collects light until the places of some stations are found.

    Attributes:
        wanted: the stations that are looked for.
        known: other stations, whose place holds.
    """

    def __init__(
        self, tell: Callable[[str], None], known: Mapping[int, StationCalibration]
    ) -> None:
        """Begin.

        Args:
            tell: is given words for the person.
            known: stations whose place holds; with some the person need not do anything.
        """
        self._tell = tell
        self.known = dict(known)
        self.wanted: dict[int, StationCalibration] = {}
        self._takes: dict[str, SurveyTake] = {}
        self._said_carry = False
        self._told = 0
        self._next = ENOUGH_MOVING
        if not known:
            tell(FIRST_WORDS)

    def want(self, number: int, calibration: StationCalibration) -> None:
        """A station says who it is, and nobody knows where it stands."""
        if self.known.pop(number, None) and not self.known:
            self._tell(FIRST_WORDS)
        news = number not in self.wanted
        self.wanted[number] = calibration
        if news and not self.known:
            names = ", ".join(station_name(c) for _, c in sorted(self.wanted.items()))
            self._tell(f"Base stations heard so far: {names}.")

    def add(self, serial: str, model: DeviceModel, decoded: Decoded) -> bool:
        """A device's next batch; True: ``request`` may have something new to say."""
        if serial not in self._takes:
            self._takes[serial] = SurveyTake(model)
        return self._takes[serial].add(decoded)

    def request(self) -> SolveRequest | None:
        """What to solve, as soon as there is enough; the same is not asked for twice."""
        if not self.wanted:
            return None
        self._say_carry()
        seen = [stations for take in self._takes.values() for stations in take.seen]
        if self.known and len(seen) >= ALONE and not any(s & set(self.known) for s in seen):
            self.known = {}  # switched off, or in another room
        # takes keep a minute each: what they hold stops growing, what went through them does not
        moved = sum(take.moved for take in self._takes.values())
        self._say_progress(moved, seen)
        if moved < self._next or self._lacks(seen):
            return None
        self._next = moved + MORE
        takes = [take.take() for take in self._takes.values() if take.seen]
        self._tell("Working out where the base stations stand.")
        return SolveRequest(takes, {**self.known, **self.wanted})

    def fault(self, solution: StationSolution) -> str:
        """What is wrong with a solution; empty: nothing."""
        missing = sorted(set(self.wanted) - set(solution.stations))
        if missing:
            names = ", ".join(station_name(self.wanted[n]) for n in missing)
            return f"{names} could not be placed: carry the tracker where it and another see it"
        worst = max(solution.residual_rad.values())
        if worst > RESIDUAL_RAD:
            return f"what was seen fits to {1e3 * worst:.1f} mrad only: was a base station moved?"
        enough = UP_AT_LAST_RAD if self._next > AT_LAST else UP_RAD
        if not self.known and solution.up_sigma_rad > enough:
            return "which way is up is not clear yet: carry it on, turn it every way"
        return ""

    def _say_carry(self) -> None:
        """Once every station in view has said who it is."""
        in_view = {n for take in self._takes.values() for n in take.in_view}
        if self._said_carry or self.known or not in_view or in_view - set(self.wanted):
            return
        self._said_carry = True
        self._tell(CARRY)

    def _say_progress(self, moved: int, seen: Sequence[frozenset[int]]) -> None:
        if self.known or not self._said_carry or moved < self._told + TOLD_EVERY:
            return
        self._told = moved
        lacks = self._lacks(seen)
        self._tell(f"{moved} moments seen. {lacks[:1].upper()}{lacks[1:]}".rstrip())

    def _lacks(self, seen: Sequence[frozenset[int]]) -> str:
        """What has not been seen often enough."""
        stations = {**self.known, **self.wanted}
        links = sum(bool(s & set(self.known)) and bool(s & set(self.wanted)) for s in seen)
        if self.known and links < ENOUGH_TOGETHER:
            return "no base station whose place is known was seen together with the others."
        for number in sorted(self.wanted):
            name = station_name(stations[number])
            if sum(number in s for s in seen) < ENOUGH_SEEN:
                return f"{name} has hardly seen the tracker: carry it there."
            together = sum(number in s and len(s & set(stations)) > 1 for s in seen)
            if len(stations) > 1 and together < ENOUGH_TOGETHER:
                return f"{name} has hardly seen the tracker together with another base station."
        return ""
