"""Where the base stations stand, kept as a file that a person can read.

    {"format": 1,
     "stations": [{"number": 0, "generation": 2, "id": "51a7b000", "unlock_count": 3,
                   "position_m": [x, y, z], "rotation_xyzw": [x, y, z, w], "residual_mrad": 0.1,
                   "calibration": {"phase_rad": [..], "tilt_rad": [..], ...}}, ...]}

The world is the tracking space (docs/conventions.md). The calibration is kept, so that tracking
starts before a station has said it again, which takes it some ten seconds.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import StationCalibration
from lobstr_hw.drivers.lighthouse.light import Station, Stations
from lobstr_hw.errors import StationFileError
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import from_quat_xyzw, to_quat_xyzw

__all__ = ["load_stations", "moved_stations", "save_stations"]

FORMAT = 1
TERMS = {
    "phase_rad": "phase",
    "tilt": "tilt",
    "curve": "curve",
    "gibphase_rad": "gibphase",
    "gibmag": "gibmag",
    "ogeephase_rad": "ogeephase",
    "ogeemag": "ogeemag",
}
"""Key in the file, name in StationCalibration; two numbers each."""


def save_stations(path: Path, stations: Stations, residual_rad: Mapping[int, float]) -> None:
    """Write a file, all of it or nothing.

    Args:
        path: its folder is made.
        stations: by number.
        residual_rad: of their solve, by number; may be empty.
    """
    rows = [_row(n, s, residual_rad.get(n)) for n, s in sorted(stations.items())]
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps({"format": FORMAT, "stations": rows}, indent=1), encoding="utf-8")
    os.replace(part, path)


def _row(number: int, station: Station, residual_rad: float | None) -> dict[str, Any]:
    c, T = station.calibration, station.T_world_station
    return {
        "number": number,
        "generation": c.generation,
        "id": f"{c.id:08x}",
        "unlock_count": c.unlock_count,
        "position_m": T.p.tolist(),
        "rotation_xyzw": to_quat_xyzw(T.R).tolist(),
        "residual_mrad": None if residual_rad is None else 1e3 * residual_rad,
        "calibration": {
            **{key: getattr(c, name).tolist() for key, name in TERMS.items()},
            "up": c.up.tolist(),
            "mode": c.mode,
        },
    }


def load_stations(path: Path) -> dict[int, Station]:
    """Read a file.

    Raises:
        StationFileError: it is missing or not such a file; the message says what to do.
    """
    again = f"solve the stations again, or name another file than {path}."
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StationFileError(f"no base stations: {path} cannot be read; {again}") from error
    except ValueError as error:
        raise StationFileError(f"{path} is no JSON ({error}); {again}") from error
    if not isinstance(said, dict) or said.get("format") != FORMAT:
        raise StationFileError(f"{path} is not a base-station file of format {FORMAT}; {again}")
    try:
        return {int(row["number"]): _station(row) for row in said["stations"]}
    except (KeyError, TypeError, ValueError) as error:
        raise StationFileError(
            f"{path}: a base station lacks or spoils {error}; {again}"
        ) from error


def _numbers(values: object, count: int, name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    array = np.array(values, dtype=np.float64)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise ValueError(f"{name} = {values}")
    return array


def _station(row: dict[str, Any]) -> Station:
    said = row["calibration"]
    generation = int(row["generation"])
    if generation not in (1, 2):
        raise ValueError(f"generation = {generation}")
    calibration = StationCalibration(
        generation,
        int(row["id"], 16),
        **{name: _numbers(said[key], 2, key) for key, name in TERMS.items()},
        up=_numbers(said["up"], 3, "up"),
        mode=int(said["mode"]),
        unlock_count=int(row["unlock_count"]),
    )
    q = _numbers(row["rotation_xyzw"], 4, "rotation_xyzw")
    if abs(float(np.linalg.norm(q)) - 1.0) > 1e-3:
        raise ValueError(f"rotation_xyzw = {q.tolist()}")
    return Station(
        calibration, Pose(from_quat_xyzw(q), _numbers(row["position_m"], 3, "position_m"))
    )


def moved_stations(stations: Stations, heard: Mapping[int, StationCalibration]) -> list[int]:
    """Stations whose place is in doubt, by what they say about themselves now.

    Args:
        stations: as solved once.
        heard: what stations said since, by number.

    Returns:
        Numbers of those with another id, restarted or pushed (unlock count), or tilted otherwise
        (over two degrees: what they say of up comes in steps of half a degree).
    """
    moved = []
    for number, station in sorted(stations.items()):
        was, now = station.calibration, heard.get(number)
        if now is None:
            continue
        tilted = bool(np.any(was.up) and np.any(now.up) and float(was.up @ now.up) < 0.9994)
        if was.id != now.id or was.unlock_count != now.unlock_count or tilted:
            moved.append(number)
    return moved
