"""First use, and stations that were moved: what is told, what is asked for, what is kept."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from hypothesis import given, settings
from hypothesis import strategies as st
from support.lighthouse_devices import named
from support.lighthouse_room import Motion, carried, imu_of, light_of, room, still

from lobstr_hw.drivers.lighthouse import station_desk, survey_take
from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles
from lobstr_hw.drivers.lighthouse.decoding import Decoded
from lobstr_hw.drivers.lighthouse.keep_known import keep_known
from lobstr_hw.drivers.lighthouse.light import Station, take_angles
from lobstr_hw.drivers.lighthouse.station_desk import StationDesk
from lobstr_hw.drivers.lighthouse.station_file import load_stations, save_stations
from lobstr_hw.drivers.lighthouse.station_solve import StationSolution
from lobstr_hw.drivers.lighthouse.survey import CARRY, FIRST_WORDS
from lobstr_hw.drivers.lighthouse.survey_take import PAUSE, SurveyTake
from lobstr_hw.errors import StationsNotSolved
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import from_rotation_vector, geodesic_angle, rotation_y

TRACKER = named("LHR-0000000A")
STATIONS = room(2)
LYING = still(np.array([0.2, 0.05, 0.1]), np.array([0.1, 0.2, 0.0]))


def batches(
    motion: Motion, seconds: float, first_s: float = 0.0, stations: dict[int, Station] = STATIONS
) -> list[Decoded]:
    """What a device tells, in pieces of 50 ms."""
    first = int(first_s * TICKS_PER_S) + 1_000_000
    imu = imu_of(motion, seconds, noise=1.0, first_tick=first)
    light = light_of(stations, TRACKER, motion, seconds, 1e-4, first_tick=first)
    edges = np.arange(first, int(imu.ticks[-1]) + 1, TICKS_PER_S // 20)
    parts = []
    for a, b in pairwise(edges.tolist()):
        i, j = np.searchsorted(imu.ticks, [a, b])
        k, n = np.searchsorted(light.ticks, [a, b])
        part = imu.take(slice(i, j))
        parts.append(Decoded(part, take_angles(light, slice(int(k), int(n))), {}))
    return parts


def moved(station: Station, unlock_count: int = 1) -> Station:
    """The same station elsewhere, as it tells it."""
    calibration = replace(station.calibration, unlock_count=unlock_count)
    T = Pose(rotation_y(0.4), np.array([0.3, 0.0, -0.2]))
    return Station(calibration, T @ station.T_world_station)


class Room:
    """A desk, what it said, and a solver that knows the answer, seen from another world."""

    def __init__(self, path: Path | None, truth: dict[int, Station]) -> None:
        self.said: list[str] = []
        self.changes: list[bool] = []
        self.truth = truth
        self.solves: list[set[int]] = []
        self.answer: Callable[[StationSolution], StationSolution] = lambda solution: solution
        self.desk = StationDesk(path, self.said.append, self.changes.append)

    def solve(self, takes: Any, calibrations: Any, progress: Any) -> StationSolution:
        self.solves.append(set(calibrations))
        progress(0.5)
        world = Pose(rotation_y(1.1), np.array([1.0, 0.2, -3.0]))
        stations = {
            n: Station(calibrations[n], world @ self.truth[n].T_world_station)
            for n in self.truth.keys() & calibrations.keys()
        }
        residual = dict.fromkeys(stations, 1e-4)
        return self.answer(StationSolution(stations, residual, {}, 1e-3, ()))

    def hear(self) -> None:
        for number, station in self.truth.items():
            self.desk.hear(number, station.calibration)

    def carry(self, seconds: float = 16.0, seed: int = 3) -> None:
        for batch in batches(carried(seed), seconds, stations=self.truth):
            self.desk.see(TRACKER.serial, TRACKER, batch)
            self.desk.work()
            self.desk.wait(5.0)
        self.desk.work()


@pytest.fixture
def make_room(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path | None, dict[int, Station]], Room]:
    def make(path: Path | None, truth: dict[int, Station]) -> Room:
        made = Room(path, truth)
        monkeypatch.setattr(station_desk, "solve_stations", made.solve)
        return made

    return make


MakeRoom = Callable[[Path | None, dict[int, Station]], Room]


def test_at_first_use_it_says_what_to_do_step_by_step_and_saves(
    make_room: MakeRoom, tmp_path: Path
) -> None:
    path = tmp_path / "new" / "stations.json"
    home = make_room(path, STATIONS)
    assert home.said == [FIRST_WORDS]
    for batch in batches(LYING, 3.0):
        home.desk.see(TRACKER.serial, TRACKER, batch)
        home.desk.work()
    assert home.said == [FIRST_WORDS], "nothing to carry before the stations are known by name"
    home.hear()
    home.carry()
    assert CARRY in home.said
    assert home.said.index(CARRY) < next(k for k, w in enumerate(home.said) if "moments" in w)
    assert any("50%" in words for words in home.said)
    assert "0.10 mrad" in home.said[-1]
    assert "saved to" in home.said[-1]
    assert home.changes == [True]
    kept = load_stations(path)
    assert {n: s.calibration.id for n, s in kept.items()} == {0: 1000, 1: 1001}
    assert StationDesk(path, home.said.append, home.changes.append).stations.keys() == {0, 1}


def test_a_device_that_lies_still_is_never_solved_from(make_room: MakeRoom) -> None:
    home = make_room(None, STATIONS)
    home.hear()
    for batch in batches(LYING, 16.0):
        home.desk.see(TRACKER.serial, TRACKER, batch)
        home.desk.work()
    assert not home.solves


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda s: replace(s, up_sigma_rad=0.05), "up"),
        (lambda s: replace(s, residual_rad={0: 1e-4, 1: 5e-3}), "mrad"),
        (lambda s: replace(s, stations={0: s.stations[0]}), "LHB-000003E9"),
    ],
)
def test_a_solve_that_is_not_good_is_told_and_tried_again(
    make_room: MakeRoom, spoil: Callable[[StationSolution], StationSolution], word: str
) -> None:
    home = make_room(None, STATIONS)
    home.hear()
    home.answer = spoil
    home.carry()
    assert [w for w in home.said if w.startswith("Not yet") and word in w]
    assert not home.desk.stations
    home.answer = lambda solution: solution
    home.carry(8.0, seed=4)
    assert home.desk.stations.keys() == {0, 1}
    assert len(home.solves) >= 2


def test_after_any_number_of_failures_it_tries_again(
    make_room: MakeRoom, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also when a take is full, and holds no more than at the try before."""
    monkeypatch.setattr(survey_take, "MOST_CHUNKS", 56)
    home = make_room(None, STATIONS)
    home.hear()
    home.answer = lambda solution: replace(solution, up_sigma_rad=0.05)
    home.carry(16.0)
    tries, words = len(home.solves), len(home.said)
    assert tries == 1
    home.carry(8.0, seed=4)
    assert len(home.solves) > tries
    assert any("moments" in w for w in home.said[words:])


def test_what_the_solver_cannot_do_is_told(make_room: MakeRoom) -> None:
    home = make_room(None, STATIONS)
    home.hear()

    def fail(solution: StationSolution) -> StationSolution:
        raise StationsNotSolved("the base stations were hardly seen")

    home.answer = fail
    home.carry()
    assert "Not yet: the base stations were hardly seen" in home.said


def test_a_moved_station_is_told_left_out_and_found_again_in_the_same_world(
    make_room: MakeRoom, tmp_path: Path
) -> None:
    path = tmp_path / "stations.json"
    save_stations(path, STATIONS, {})
    elsewhere = {0: STATIONS[0], 1: moved(STATIONS[1])}
    home = make_room(path, elsewhere)
    home.hear()
    assert ["LHB-000003E9 was moved" in words for words in home.said] == [True]
    assert home.desk.stations.keys() == {0}
    home.carry()
    found, true = home.desk.stations[1].T_world_station, elsewhere[1].T_world_station
    np.testing.assert_allclose(found.p, true.p, atol=1e-6)
    assert geodesic_angle(found.R, true.R) < 1e-6
    kept = home.desk.stations[0].T_world_station
    np.testing.assert_array_equal(kept.p, load_stations(path)[0].T_world_station.p)
    assert home.changes == [True, True], "left out; found; in the world as it was"


def test_where_all_were_moved_the_world_is_another_one_and_that_is_told(
    make_room: MakeRoom, tmp_path: Path
) -> None:
    path = tmp_path / "stations.json"
    save_stations(path, STATIONS, {})
    home = make_room(path, {n: moved(s) for n, s in STATIONS.items()})
    home.hear()
    assert FIRST_WORDS in home.said
    home.carry()
    assert home.changes[-1] is False
    assert "calibrate again" in home.said[-1]


def test_stations_of_another_room_are_given_up(make_room: MakeRoom, tmp_path: Path) -> None:
    path = tmp_path / "stations.json"
    strange = {5: Station(replace(STATIONS[0].calibration, id=77), Pose.identity())}
    save_stations(path, strange, {})
    home = make_room(path, STATIONS)
    home.hear()
    home.carry(40.0)
    assert home.desk.stations.keys() == {0, 1}


def test_a_station_on_another_channel_is_known_by_its_number(
    make_room: MakeRoom, tmp_path: Path
) -> None:
    path = tmp_path / "stations.json"
    save_stations(path, STATIONS, {})
    home = make_room(path, {0: STATIONS[0], 4: STATIONS[1]})
    home.hear()
    assert home.desk.stations.keys() == {0, 4}
    assert not home.said
    np.testing.assert_array_equal(
        home.desk.stations[4].T_world_station.p, STATIONS[1].T_world_station.p
    )


@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), st.integers(1, 3))
@settings(max_examples=20)
def test_joining_worlds_undoes_any_move(move: list[float], count: int) -> None:
    many = room(2, count=4)
    T = Pose(from_rotation_vector(np.array(move[:3])), np.array(move[3:]))
    solved = {n: Station(s.calibration, T @ s.T_world_station) for n, s in many.items()}
    joined = keep_known(solved, {n: many[n] for n in range(count)})
    assert joined is not None
    for n, station in joined.items():
        np.testing.assert_allclose(station.T_world_station.p, many[n].T_world_station.p, atol=1e-9)
    assert keep_known(solved, {}) is None


def test_a_take_keeps_what_moves_and_moves_the_rest_together() -> None:
    kept = SurveyTake(TRACKER)
    for batch in batches(carried(1), 2.0):
        kept.add(batch)
    for batch in batches(LYING, 3.0, first_s=2.0):
        kept.add(batch)
    for batch in batches(carried(2), 2.0, first_s=500.0):
        kept.add(batch)
    take = kept.take()
    gaps = np.diff(take.imu.ticks)
    assert np.all(gaps > 0)
    assert gaps.max() <= PAUSE
    assert take.imu.ticks[-1] - take.imu.ticks[0] < 9 * TICKS_PER_S
    assert 13 <= len(kept.seen) <= 16
    assert {0, 1} >= set().union(*kept.seen)
    apart = np.abs(take.angles.ticks[:, None] - take.imu.ticks[::25][None]).min(axis=1)
    assert apart.max() < TICKS_PER_S // 4, "light stays with its IMU samples"


def test_a_take_without_light_keeps_nothing() -> None:
    kept = SurveyTake(TRACKER)
    for batch in batches(carried(1), 1.0):
        assert not kept.add(replace(batch, angles=Angles.join([])))
    assert len(kept.take().imu) == 0
