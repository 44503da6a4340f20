"""What is known of the base stations of a room: from the file, from their light, from a solve.

One desk for all devices of a driver. It is used by one thread only; a solve, some seconds of work,
runs beside it in a thread of its own.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Thread

from lobstr_hw.drivers.lighthouse.angles import DeviceModel, StationCalibration
from lobstr_hw.drivers.lighthouse.decoding import Decoded
from lobstr_hw.drivers.lighthouse.keep_known import keep_known
from lobstr_hw.drivers.lighthouse.light import Station
from lobstr_hw.drivers.lighthouse.station_file import load_stations, moved_stations, save_stations
from lobstr_hw.drivers.lighthouse.station_solve import StationSolution, solve_stations
from lobstr_hw.drivers.lighthouse.survey import SolveRequest, Survey, station_name
from lobstr_hw.errors import StationsNotSolved

__all__ = ["StationDesk"]

FOUND_AS_YOU_MOVE = (
    "move a tracker about where it and another see it, and its place is found again."
)
FOUND_ANEW = "do as you are told next, and its place is found again."
FAILED = "the solve failed. Carry the tracker on; if this stays, report it."
TOLD_SHARES = 4
"""How often a solve tells how far it is."""


class StationDesk:
    """Knows the stations.

    Attributes:
        stations: those whose place is known, by the number that angles carry.
        heard: what stations said of themselves, by number.
    """

    def __init__(
        self,
        path: Path | None,
        tell: Callable[[str], None],
        changed: Callable[[bool], None],
    ) -> None:
        """Read the file, if there is one.

        Args:
            path: of the stations; None: they are not kept.
            tell: is given words for the person.
            changed: is called when ``stations`` changed; with False when the world was replaced.

        Raises:
            StationFileError: the file is there and cannot be used.
        """
        self._path, self._tell, self._changed = path, tell, changed
        self.stations: dict[int, Station] = {}
        self.heard: dict[int, StationCalibration] = {}
        self._by_id: dict[int, Station] = {}
        self._residual_rad: dict[int, float] = {}
        self._survey: Survey | None = None
        self._solving: Thread | None = None
        self._news = False
        self._told_share = 0.0
        self._solved: StationSolution | StationsNotSolved | None = None
        if path is not None and path.exists():
            self.stations = load_stations(path)
            self._by_id = {s.calibration.id: s for s in self.stations.values()}
        self._had_world = bool(self.stations)
        if not self.stations:
            self._survey = Survey(tell, {})

    @property
    def surveying(self) -> bool:
        """Whether it wants to be shown what devices see."""
        return self._survey is not None

    def hear(self, number: int, calibration: StationCalibration) -> None:
        """A station said who it is."""
        before = self.heard.get(number)
        self.heard[number] = calibration
        if before is not None and _same(before, calibration):
            return
        known = self.stations.get(number)
        if known is not None and not moved_stations({number: known}, self.heard):
            return
        if self._renumbered(number, calibration):
            return
        if known is not None:
            self._doubt(number, known)
        self._want(number, calibration)

    def _renumbered(self, number: int, calibration: StationCalibration) -> bool:
        """A station of the file may have got another channel, or another place in the rhythm."""
        station = self._by_id.get(calibration.id)
        if station is None or moved_stations({number: station}, {number: calibration}):
            return False
        others = {n: s for n, s in self.stations.items() if s.calibration.id != calibration.id}
        self.stations = others | {number: replace(station, calibration=calibration)}
        self._changed(True)
        return True

    def _doubt(self, number: int, station: Station) -> None:
        """It does not stand where it stood, or nobody can be sure."""
        self.stations = {n: s for n, s in self.stations.items() if n != number}
        self._by_id.pop(station.calibration.id, None)
        if station.calibration.id == self.heard[number].id:
            rest = FOUND_AS_YOU_MOVE if self.stations else FOUND_ANEW
            self._tell(f"{station_name(station.calibration)} was moved or restarted: {rest}")
        self._changed(True)

    def _want(self, number: int, calibration: StationCalibration) -> None:
        if self._survey is None:
            known = {n: s.calibration for n, s in self.stations.items()}
            self._survey = Survey(self._tell, known)
        self._survey.want(number, calibration)

    def see(self, serial: str, model: DeviceModel, decoded: Decoded) -> None:
        """What a device saw, while surveying."""
        if self._survey is not None and self._survey.add(serial, model, decoded):
            self._news = True

    def work(self) -> None:
        """Start a solve when there is enough for one; take up what it found."""
        if self._survey is None:
            return
        if self._solving is None:
            news, self._news = self._news, False
            request = self._survey.request() if news else None
            if request is not None:
                self._solving = Thread(
                    target=self._solve, args=(request,), name="lobstr-solve", daemon=True
                )
                self._solving.start()
        elif not self._solving.is_alive():
            self._solving = None
            self._take_up(self._survey, self._solved)

    def wait(self, wait_s: float) -> None:
        """Wait for a solve that is running; it holds nothing, so nobody has to."""
        if self._solving is not None:
            self._solving.join(wait_s)

    def _solve(self, request: SolveRequest) -> None:
        self._solved = None
        try:
            self._solved = solve_stations(
                request.takes, request.calibrations, progress=self._progress
            )
        except StationsNotSolved as error:
            self._solved = error

    def _progress(self, share: float) -> None:
        """Of the solve; from its own thread."""
        step = int(share * TOLD_SHARES) / TOLD_SHARES
        if step > self._told_share and step < 1.0:
            self._tell(f"Working out where the base stations stand: {step:.0%}.")
        self._told_share = step

    def _take_up(self, survey: Survey, solved: StationSolution | StationsNotSolved | None) -> None:
        if not isinstance(solved, StationSolution):
            self._tell(f"Not yet: {solved or FAILED}")
            return
        fault = survey.fault(solved)
        if fault:
            self._tell(f"Not yet: {fault}.")
            return
        known = {n: s for n, s in self.stations.items() if n in survey.known}
        joined = keep_known(solved.stations, known) if known else solved.stations
        if joined is None:
            self._tell("Not yet: no base station whose place is known was seen with them.")
            return
        same_world = bool(known) or not self._had_world
        self.stations, self._had_world = joined, True
        self._by_id = {s.calibration.id: s for s in self.stations.values()}
        self._residual_rad.update(solved.residual_rad)
        self._survey = None
        self._tell(self._result(solved) + self._kept())
        self._changed(same_world)
        if not same_world:
            self._tell("The origin of the room is another one now: calibrate again.")

    def _result(self, solved: StationSolution) -> str:
        parts = [
            f"{station_name(self.stations[n].calibration)} ({1e3 * rad:.2f} mrad)"
            for n, rad in sorted(solved.residual_rad.items())
        ]
        up = f"up is known to {math.degrees(solved.up_sigma_rad):.1f} degrees"
        return f"Base stations found: {', '.join(parts)}; {up}"

    def _kept(self) -> str:
        if self._path is None:
            return "."
        try:
            save_stations(self._path, self.stations, self._residual_rad)
        except OSError as error:
            return f"; they could not be saved to {self._path} ({error})."
        return f"; saved to {self._path}."


def _same(a: StationCalibration, b: StationCalibration) -> bool:
    return (a.id, a.unlock_count, a.mode) == (b.id, b.unlock_count, b.mode) and bool(
        (a.up == b.up).all()
    )
