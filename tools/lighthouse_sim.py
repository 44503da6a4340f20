"""Track simulated Lighthouse devices and compare with the truth: `lighthouse_sim.py SIM_FOLDER`.

A set is NAME.json (stations, device configuration) and NAME.npz (IMU, light, truth) in the format
of libsurvive's simulator; its world has Z up.
"""

import argparse
import datetime
import json
import math
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from results_page import write_section

from lobstr_hw.drivers.lighthouse.angles import (
    TICKS_PER_S,
    Angles,
    DeviceModel,
    ImuSamples,
    Ints,
    StationCalibration,
)
from lobstr_hw.drivers.lighthouse.light import Station, Stations, take_angles
from lobstr_hw.drivers.lighthouse.station_solve import solve_stations
from lobstr_hw.drivers.lighthouse.station_views import Take
from lobstr_hw.drivers.lighthouse.tracker import (
    Fix,
    PoseBatch,
    TrackerSettings,
    begin,
    join_poses,
    step,
)
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_quat_xyzw, geodesic_angle

PERIODS = 1000 * np.array(
    [959, 957, 953, 949, 947, 943, 941, 939, 937, 929, 919, 911, 907, 901, 893, 887]
)
"""Ticks of a turn of a Gen2 station, by channel."""
STEP = TICKS_PER_S // 1000


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedSet:
    """One set, in our world (Y up)."""

    name: str
    stations: dict[int, Station]
    model: DeviceModel
    imu: ImuSamples
    angles: Angles
    truth_ticks: Ints
    truth_p: Array
    truth_R: Array
    truth_v: Array


def y_up_from_z_up(p: Array, R: Array | None = None) -> tuple[Array, Array]:
    """Positions (..., 3) and rotations of a world with Z up, in ours: (x, z, -y)."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return np.asarray(p) @ turn.T, turn @ (np.eye(3) if R is None else R)


def _rotation_wxyz(q: Array) -> Array:
    return from_quat_xyzw(np.roll(np.asarray(q, dtype=np.float64), -1, axis=-1))


def _station(generation: int, b: dict[str, list[float]]) -> Station:
    tilt = np.array(b["tilt"])
    calibration = StationCalibration(
        generation,
        int(b["id"]),  # type: ignore[call-overload]
        phase=np.array(b["phase"]),
        tilt=np.tan(tilt) if generation == 1 else tilt,
        curve=np.array(b["curve"]),
        gibphase=np.array(b["gibpha"]),
        gibmag=np.array(b["gibmag"]),
        ogeephase=np.array(b["ogeephase"]),
        ogeemag=np.array(b["ogeemag"]),
    )
    p, R = y_up_from_z_up(np.array(b["pose"][:3]), _rotation_wxyz(np.array(b["pose"][3:])))
    return Station(calibration, Pose(R, p))


def _model(name: str, config: dict[str, object]) -> DeviceModel:
    def pose(key: str) -> Pose:
        v = np.array(config[key])
        return Pose(from_quat_xyzw(v[:4]), v[4:])

    light: dict[str, list[list[float]]] = config["lighthouse_config"]  # type: ignore[assignment]
    T_imu_trackref = pose("trackref_from_imu").inverse()
    points = T_imu_trackref.apply(np.array(light["modelPoints"]))
    normals = np.array(light["modelNormals"]) @ T_imu_trackref.R.T
    n = len(points)
    return DeviceModel(
        name, "simulated", "simulated", points, normals, np.arange(n), T_imu_trackref,
        T_imu_trackref @ pose("trackref_from_head"),
        np.zeros(3), np.ones(3), np.zeros(3), np.ones(3),
    )  # fmt: skip


def _gen2_angles(sync: Ints, sweep: Ints, held: bool) -> Angles:
    """Sweeps to angles by the last sync of their channel (period: nominal).

    The simulator holds the pose for each step of 1 ms at what the truth has at the step's end:
    ``held`` gives a hit the time of the pose that it saw, half a millisecond later on average.
    """
    parts = []
    for channel in np.unique(sweep[:, 0]):
        turns = np.sort(sync[sync[:, 0] == channel, 1])
        mine = sweep[sweep[:, 0] == channel]
        last = np.searchsorted(turns, mine[:, 2], side="right") - 1
        mine, last = mine[last >= 0], last[last >= 0]
        turn = np.mod((mine[:, 2] - turns[last]) / PERIODS[channel], 1.0) * 2.0 * math.pi
        axis = (turn > math.pi).astype(np.int64)
        angle = turn - np.where(axis == 0, 2.0, 4.0) * math.pi / 3.0
        parts.append((mine[:, 2], mine[:, 0], axis, mine[:, 1], angle))
    ticks, station, axis, sensor, angle = (np.concatenate(c) for c in zip(*parts, strict=True))
    if held:
        ticks = -(-ticks // STEP) * STEP
    order = np.argsort(ticks, kind="stable")
    return Angles(ticks[order], station[order], axis[order], sensor[order], angle[order])


def read_set(path: Path, held: bool = True) -> SimulatedSet:
    """Read NAME.json and the NAME.npz beside it; ``held``: see _gen2_angles."""
    said = json.loads(path.read_text(encoding="utf-8"))
    arrays = np.load(path.with_suffix(".npz"))
    generation = int(said["generation"])
    numbered = {
        int(b["channel" if generation == 2 else "index"]): _station(generation, b)
        for b in said["base_stations"]
    }
    if generation == 1:
        index = arrays["angle_idx"].astype(np.int64)
        angles = Angles(arrays["angle_tc"], index[:, 0], index[:, 1], index[:, 2], arrays["angle"])
    else:
        angles = _gen2_angles(arrays["sync"], arrays["sweep"], held)
    imu = arrays["imu"].astype(np.float64)
    truth = arrays["gt"].astype(np.float64)
    p, R = y_up_from_z_up(truth[:, :3], _rotation_wxyz(truth[:, 3:7]))
    v, _ = y_up_from_z_up(truth[:, 7:10])
    return SimulatedSet(
        path.stem, numbered, _model(path.stem, said["device_config"]),
        ImuSamples(arrays["imu_tc"], imu[:, :3], imu[:, 3:]), angles, arrays["gt_tc"], p, R, v,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Score:
    """How far poses are from the truth: positions in mm, rotations in degrees.

    Attributes:
        mm, mm_95, degrees, degrees_95: median and 95th percentile.
        tracked: share of the IMU's samples with a pose by light or within 100 ms of it.
        scale: of the world, less one; 0 where stations were given.
        gravity_degrees: between up and up.
        cpu: seconds of one core for a second of data (tracking), and of the stations' solve.
        solve_s: likewise, in all.
        hits_per_s: of light, solved with one core kept busy.
    """

    mm: float
    mm_95: float
    degrees: float
    degrees_95: float
    tracked: float
    scale: float
    gravity_degrees: float
    cpu: float
    solve_s: float
    hits_per_s: float


PIECE = 11 * TICKS_PER_S // 1000
"""Data come in pieces of 11 ms, as a loop at 90 Hz would fetch them."""


def follow(data: SimulatedSet, stations: Stations) -> tuple[PoseBatch, float]:
    """All poses, and the seconds it took."""
    begun = time.process_time()
    state, given, settings = begin(), [], TrackerSettings()
    for since in range(int(data.imu.ticks[0]), int(data.imu.ticks[-1]) + PIECE, PIECE):
        i, j = np.searchsorted(data.imu.ticks, [since, since + PIECE])
        k, n = np.searchsorted(data.angles.ticks, [since, since + PIECE])
        imu = data.imu.take(slice(i, j))
        light = take_angles(data.angles, slice(int(k), int(n)))
        state, batch = step(state, data.model, stations, imu, light, settings)
        given.append(batch)
    return join_poses(given), time.process_time() - begun


def score(data: SimulatedSet, solve: bool) -> Score:
    """Track a set with its true stations, or with stations solved from the set itself."""
    begun, stations = time.process_time(), data.stations
    if solve:
        calibrations = {n: s.calibration for n, s in data.stations.items()}
        stations = solve_stations([Take(data.model, data.imu, data.angles)], calibrations).stations
    solve_s = time.process_time() - begun
    poses, seconds = follow(data, stations)
    i = np.searchsorted(data.truth_ticks, poses.ticks)
    tracked = (i < len(data.truth_ticks)) & (poses.fix != Fix.LOST)
    p, R = poses.p[tracked], poses.R[tracked]
    true_p, true_R = data.truth_p[i[tracked]], data.truth_R[i[tracked]]
    turn, move, scale = aligned(p, true_p) if solve else (np.eye(3), np.zeros(3), 1.0)
    mm = 1e3 * np.linalg.norm(p @ turn.T + move - true_p, axis=1)
    degrees = np.degrees(geodesic_angle(turn @ R, true_R))
    duration = float(data.imu.ticks[-1] - data.imu.ticks[0]) / TICKS_PER_S
    return Score(
        float(np.median(mm)), float(np.percentile(mm, 95)),
        float(np.median(degrees)), float(np.percentile(degrees, 95)),
        float(np.count_nonzero(tracked) / len(data.imu)), scale - 1.0,
        float(np.degrees(np.arccos(min(turn[1, 1], 1.0)))),
        seconds / duration, solve_s, len(data.angles) / seconds,
    )  # fmt: skip


def aligned(p: Array, true_p: Array) -> tuple[Array, Array, float]:
    """The rigid motion that takes points (n, 3) best to the true ones, and the scale left over."""
    a, b = p - p.mean(axis=0), true_p - true_p.mean(axis=0)
    U, S, Vt = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    turn = U @ (sign[:, None] * Vt)
    return turn, true_p.mean(axis=0) - turn @ p.mean(axis=0), float(S @ sign / np.sum(a**2))


HEADING = "## Lighthouse solving (simulated)"
TEXT = """\
On the sets of libsurvive's simulator, on a machine with other work (read the times as upper
bounds). Clean: exact angles; noisy: 0.1 mrad of noise, a fifth of the hits missing, a gyro bias of
3 degrees/s that drifts. Every pose is scored that is not `LOST`, from the first on, at its IMU
sample's own time: up to 42 ms after the last light in it. `solved`: stations unknown, found from
the set itself (after one rigid alignment of the worlds). The bars: clean 0.5 mm and 0.05 degrees,
noisy 2 mm and 0.3 degrees (medians; 95 % three times that; twice as much where solved), scale
0.5 %, gravity 0.3 degrees."""
NOTES = """\
Not tracked: the time before the first light, and the first tenth of a second of it. In the Gen2
sets the simulator holds the pose for each millisecond at what the truth has at its end; the reader
gives a hit that pose's time. Without that (half a millisecond at 0.8 m/s and 100 degrees/s) the
clean Gen2 set has 0.35 mm and 0.05 degrees. The sets turn about one axis all the time, so an
accelerometer bias along it cannot be told from gravity: the solve itself says up is known to 1.2
degrees (the bias's prior), though the simulated accelerometer has none."""
HEAD = """\
| set | stations | mm | mm 95 % | degrees | degrees 95 % | tracked % | scale % | gravity degrees \
| core % | hits/s a core |
|---|---|---|---|---|---|---|---|---|---|---|"""


def line(name: str, s: Score, solved: bool) -> str:
    """A row of the table."""
    how = f"solved in {s.solve_s:.1f} s" if solved else "given"
    world = f"{100 * s.scale:+.3f} | {s.gravity_degrees:.3f}" if solved else "- | -"
    return (
        f"| {name} | {how} | {s.mm:.3f} | {s.mm_95:.3f} | {s.degrees:.3f} |"
        f" {s.degrees_95:.3f} | {100 * s.tracked:.1f} | {world} | {100 * s.cpu:.0f} |"
        f" {s.hits_per_s:.0f} |"
    )


def main() -> None:
    """Print the section, write it where asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog="example: python tools/lighthouse_sim.py data/lighthouse/sim"
    )
    parser.add_argument("folder", type=Path, help="with NAME.json and NAME.npz")
    parser.add_argument("--write", type=Path, help="a file with such a section, to be replaced")
    asked = parser.parse_args()
    paths = sorted(asked.folder.glob("*.json"))
    if not paths:
        parser.error("no NAME.json in this folder")
    rows = []
    for path in paths:
        data = read_set(path)
        for solve in (False, True):
            rows.append(line(data.name, score(data, solve), solve))
            print(rows[-1], flush=True)
    command = f"`python tools/lighthouse_sim.py lighthouse/sim`, {datetime.date.today()}."
    text = "\n".join([HEADING, "", TEXT, "", command, "", HEAD, *rows, "", NOTES])
    if asked.write is not None:
        write_section(text, asked.write)


if __name__ == "__main__":
    main()
