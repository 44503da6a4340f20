"""Recordings of Lighthouse devices -> a tracker log: decoded, stations solved, tracked."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lobstr_hw.drivers.lighthouse.angles import DeviceModel
from lobstr_hw.drivers.lighthouse.device_config import parse_config
from lobstr_hw.drivers.lighthouse.light import Stations
from lobstr_hw.drivers.lighthouse.recorded_tracking import (
    RecordedTake,
    read_takes,
    solve_takes,
    track_takes,
)
from lobstr_hw.drivers.lighthouse.recordings import read_recording
from lobstr_hw.drivers.lighthouse.station_file import load_stations, save_stations
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracker_state import Fix
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.errors import FileFormatError, StationsNotSolved
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.commands.log_report import Report, Step, whole_file
from lobstr_hw.runtime.commands.recording_kind import RecordingKind, recording_kind
from lobstr_hw.trackers import TrackerSample, TrackingState

__all__ = ["import_recordings"]

PAUSE_S = 1.0
"""Between two recordings of one device that do not say which was first."""
BATCH = 500
STATES = {
    Fix.LIGHT: TrackingState.OK,
    Fix.INERTIAL: TrackingState.OK,  # as live: a tenth of a second in the dark at most
    Fix.LOST: TrackingState.OCCLUDED,
}


@dataclass(frozen=True, slots=True, eq=False)
class _Tracked:
    """One device of one recording: its poses, and their times in the log, in seconds."""

    take: RecordedTake
    poses: TimedPoses
    time_s: Array


def import_recordings(
    files: Sequence[Path],
    out: Path,
    config: Path | None,
    stations_file: Path | None,
    save: Path | None,
    step: Step,
) -> Report:
    """Write the log of recordings of one room.

    Args:
        files: of devices that were there at once, or one after the other.
        out: the log to write.
        config: a device's JSON, or a recording that has it, or None.
        stations_file: where the stations stand, or None: worked out from all recordings.
        save: where to keep the stations, or None.
        step: moves the progress bar.

    Raises:
        FileFormatError: nothing to track in one of the files, or they have no common clock; says
            why.
        StationsNotSolved: too little light.
    """
    kinds = {recording_kind(path) for path in files}
    if len(kinds) > 1:
        raise FileFormatError(
            "captures of USB say what time it was, libsurvive's text how long it ran: the two have "
            "no time in common. Import each kind into a log of its own."
        )
    model = None if config is None else _known_model(config)
    takes = []
    for done, path in enumerate(files):
        step(done, 2 * len(files) + 1, f"reading {path.name}")
        takes.append(read_takes(path, model))
    step(len(files), what="working out where the base stations stand")
    stations, residual = _stations([t for of_file in takes for t in of_file], stations_file)
    if save is not None:
        save_stations(save, stations, residual)
    tracked: list[_Tracked] = []
    for done, of_file in enumerate(takes):
        step(len(files) + 1 + done, what=f"following the devices of {of_file[0].path.name}")
        tracked += _placed(of_file, track_takes(of_file, stations), tracked)
    with whole_file(out) as part:
        _write(part, tracked, kinds == {RecordingKind.USB})
    return _report(out, tracked, stations, residual)


def _known_model(path: Path) -> DeviceModel:
    """The device that a JSON file describes, or the one that a recording has."""
    if path.is_file() and path.read_bytes().lstrip()[:1] == b"{":
        return parse_config(path.read_bytes())
    models = {m.serial: m for d in read_recording(path) if (m := d.model) is not None}
    if len(models) != 1:
        raise FileFormatError(
            f"{path} has the configuration of {len(models)} devices ({', '.join(sorted(models))}), "
            "which does not tell the one that is meant: name the JSON of one."
        )
    return next(iter(models.values()))


def _stations(
    takes: Sequence[RecordedTake], path: Path | None
) -> tuple[Stations, dict[int, float]]:
    if path is not None:
        return load_stations(path), {}
    solution = solve_takes(takes)
    return solution.stations, solution.residual_rad


def _placed(
    takes: Sequence[RecordedTake], poses: Sequence[TimedPoses], before: Sequence[_Tracked]
) -> list[_Tracked]:
    """The devices of a file in the log's time: as recorded, but none at two times at once."""
    seen = [(take, p) for take, p in zip(takes, poses, strict=True) if len(p)]
    times = [take.clock.seconds(p.ticks) for take, p in seen]
    ends = [
        t.time_s.max() for t in before if t.take.model.serial in {k.model.serial for k, _ in seen}
    ]
    first = min((float(t.min()) for t in times), default=0.0)
    later = max(ends) + PAUSE_S - first if ends and first < max(ends) else 0.0
    return [_Tracked(take, p, t + later) for (take, p), t in zip(seen, times, strict=True)]


def _write(path: Path, tracked: Sequence[_Tracked], is_unix: bool) -> None:
    if not tracked:
        raise StationsNotSolved(
            "no device saw enough light of these stations for a pose. Is it the right file of "
            "stations, and were they moved since?"
        )
    begin_s = min(float(t.time_s.min()) for t in tracked)
    with TrackerLogWriter(path) as writer:
        writer.metadata("lighthouse", {t.take.model.serial: _words(t.take.model) for t in tracked})
        if is_unix:
            writer.mark_clock(begin_s)
        batch: list[TrackerSample] = []
        for sample in _by_time(tracked, begin_s):
            batch.append(sample)
            if len(batch) == BATCH:
                writer.add_samples(batch)
                batch = []
        writer.add_samples(batch)


def _words(model: DeviceModel) -> str:
    return f"{model.device_class}: {model.model}"


def _by_time(tracked: Sequence[_Tracked], begin_s: float) -> Iterator[TrackerSample]:
    time_s = np.concatenate([t.time_s for t in tracked]) - begin_s
    which = np.repeat(np.arange(len(tracked)), [len(t.poses) for t in tracked])
    row = np.concatenate([np.arange(len(t.poses)) for t in tracked])
    for k in np.argsort(time_s, kind="stable").tolist():
        t = tracked[int(which[k])]
        yield _sample(t, int(row[k]), float(time_s[k]))


def _sample(t: _Tracked, row: int, time_s: float) -> TrackerSample:
    fix = Fix(int(t.poses.fix[row]))
    pose = PartialPose(t.poses.R[row], t.poses.p[row])
    velocity, covariance = t.poses.velocity[row], t.poses.covariance[row]
    is_tracked = fix is not Fix.LOST
    serial = t.take.model.serial
    return TrackerSample(serial, pose, time_s, is_tracked, STATES[fix], velocity, covariance)


def _report(
    out: Path, tracked: Sequence[_Tracked], stations: Stations, residual: dict[int, float]
) -> Report:
    devices = [
        {
            "serial": t.take.model.serial,
            "class": t.take.model.device_class,
            "model": t.take.model.model,
            "file": str(t.take.path),
            "samples": len(t.poses),
            "seconds": round(float(np.ptp(t.time_s)), 3),
            "tracked": round(float(np.mean(t.poses.tracked)), 4),
        }
        for t in tracked
    ]
    places: list[dict[str, Any]] = [
        {
            "number": n,
            "id": f"{s.calibration.id:08x}",
            "position_m": [round(v, 4) for v in s.T_world_station.p.tolist()],
            "residual_mrad": round(1e3 * residual[n], 3) if n in residual else None,
        }
        for n, s in sorted(stations.items())
    ]
    document = {"file": str(out), "kind": "lighthouse", "devices": devices, "stations": places}
    lines = [f"{out}: {sum(len(t.poses) for t in tracked)} samples, {len(stations)} base stations"]
    lines += [
        f"  {d['serial']} {d['class']} ({d['model']}): {d['seconds']:.1f} s, "
        f"tracked {100 * float(d['tracked']):.1f} %"  # type: ignore[arg-type]
        for d in devices
    ]
    return Report("\n".join(lines), document)
