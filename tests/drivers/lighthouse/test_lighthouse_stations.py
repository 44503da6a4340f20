"""Laws of solving where base stations stand, and of keeping it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.lighthouse_room import carried, device, imu_of, light_of, room

from lobstr_hw.drivers.lighthouse.angles import Angles, StationCalibration
from lobstr_hw.drivers.lighthouse.light import Station
from lobstr_hw.drivers.lighthouse.station_file import load_stations, moved_stations, save_stations
from lobstr_hw.drivers.lighthouse.station_solve import StationSolution, solve_stations
from lobstr_hw.drivers.lighthouse.station_views import Take
from lobstr_hw.errors import StationFileError, StationsNotSolved
from lobstr_hw.rotations import geodesic_angle

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")


def calibrations(stations: dict[int, Station]) -> dict[int, StationCalibration]:
    return {n: s.calibration for n, s in stations.items()}


def takes(stations: dict[int, Station], seed: int, seconds: float = 4.0) -> list[Take]:
    model, motion = device(), carried(seed)
    imu = imu_of(motion, seconds, noise=1.0, gyro_bias=0.02)
    return [Take(model, imu, light_of(stations, model, motion, seconds, noise_rad=5e-5))]


def assert_as_in(solution: StationSolution, stations: dict[int, Station]) -> None:
    """As the truth but for a turn about the vertical and a move."""
    assert set(solution.stations) == set(stations)
    first = min(stations)
    A, B = solution.stations[first].T_world_station, stations[first].T_world_station
    turn = B.R @ A.R.T
    assert np.degrees(np.arccos(min(turn[1, 1], 1.0))) < 0.3
    for n in stations:
        got, true = solution.stations[n].T_world_station, stations[n].T_world_station
        size = np.linalg.norm(true.p - B.p)
        assert np.linalg.norm(turn @ (got.p - A.p) - (true.p - B.p)) < 0.005 + 0.002 * size
        assert geodesic_angle(turn @ got.R, true.R) < 0.003


@pytest.mark.parametrize(("generation", "count"), [(1, 2), (2, 3)])
def test_stations_are_found_from_what_a_carried_device_saw(generation: int, count: int) -> None:
    stations = room(generation, seed=generation, count=count)
    solution = solve_stations(takes(stations, 1, 3.0), calibrations(stations), at_most=12)
    assert_as_in(solution, stations)
    assert solution.unsolved == ()
    first = solution.stations[0].T_world_station.p  # ahead; the device's lowest place is the floor
    assert abs(first[0]) < 1e-6 and first[2] < 0.0
    assert 0.5 < first[1] < 2.5
    assert max(solution.residual_rad.values()) < 2e-4


def test_a_station_never_seen_with_the_others_is_named_not_guessed() -> None:
    stations = room(2, count=2)
    apart = []
    for take in takes(stations, 1):
        half = np.median(take.angles.ticks)
        a = take.angles
        keep = (a.station == 0) == (a.ticks < half)
        light = Angles(
            a.ticks[keep], a.station[keep], a.axis[keep], a.sensor[keep], a.angle_rad[keep]
        )
        apart.append(Take(take.model, take.imu, light))
    solution = solve_stations(apart, calibrations(stations), at_most=14)
    assert len(solution.stations) == 1
    assert set(solution.stations) | set(solution.unsolved) == {0, 1}


def test_too_little_light_is_told_with_what_to_do() -> None:
    stations = room(2)
    with pytest.raises(StationsNotSolved, match="carry a tracker slowly"):
        solve_stations(takes(stations, 1, seconds=0.2), calibrations(stations))


def test_a_station_file_keeps_everything(tmp_path: Path) -> None:
    stations = room(2, count=3)
    path = tmp_path / "new" / "stations.json"
    save_stations(path, stations, {0: 1e-4})
    back = load_stations(path)
    assert list(path.parent.iterdir()) == [path]
    for n, s in stations.items():
        np.testing.assert_allclose(back[n].T_world_station.R, s.T_world_station.R, atol=1e-12)
        np.testing.assert_array_equal(back[n].T_world_station.p, s.T_world_station.p)
        for name in ("phase", "tilt", "curve", "gibphase", "gibmag", "ogeephase", "ogeemag", "up"):
            np.testing.assert_array_equal(
                getattr(back[n].calibration, name), getattr(s.calibration, name)
            )
        assert back[n].calibration.id == s.calibration.id


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"format": 2}', '{"format": 1, "stations": [{"number": 0}]}']
)
def test_a_file_that_is_none_is_refused_with_what_to_do(tmp_path: Path, text: str) -> None:
    path = tmp_path / "stations.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(StationFileError, match="solve the stations again"):
        load_stations(path)


@pytest.mark.parametrize(
    "spoil", ["position_m", "rotation_xyzw", "calibration", "generation", "id"]
)
def test_a_spoilt_entry_is_refused(tmp_path: Path, spoil: str) -> None:
    path = tmp_path / "stations.json"
    save_stations(path, room(1), {})
    said = json.loads(path.read_text(encoding="utf-8"))
    said["stations"][0][spoil] = [0.0, float("nan"), 0.0, 0.0]
    path.write_text(json.dumps(said), encoding="utf-8")
    with pytest.raises(StationFileError):
        load_stations(path)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(StationFileError, match="cannot be read"):
        load_stations(tmp_path / "none.json")


def test_a_station_that_was_pushed_or_restarted_is_noticed() -> None:
    up = np.array([0.0, 1.0, 0.0])
    stations = {
        n: replace(s, calibration=replace(s.calibration, up=up, unlock_count=3))
        for n, s in room(2, count=3).items()
    }
    heard = calibrations(stations)
    assert moved_stations(stations, heard) == []
    heard[1] = replace(heard[1], unlock_count=4)
    heard[2] = replace(heard[2], up=np.array([0.0, np.cos(0.1), np.sin(0.1)]))
    assert moved_stations(stations, heard) == [1, 2]
