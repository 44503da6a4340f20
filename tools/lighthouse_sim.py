"""Track simulated Lighthouse devices and compare with the truth: `lighthouse_sim.py SIM_FOLDER`.

A set is NAME.json (stations, device configuration) and NAME.npz (IMU, light, truth) in the format
of libsurvive's simulator; its world has Z up.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import (
    TICKS_PER_S,
    Angles,
    DeviceModel,
    ImuSamples,
    Ints,
    StationCalibration,
)
from lobstr_hw.drivers.lighthouse.light import Station
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_quat_xyzw

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
    return p @ turn.T, turn @ (np.eye(3) if R is None else R)


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
