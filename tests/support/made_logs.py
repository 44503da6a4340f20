"""Small tracker logs, made as recordings are."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from support.motions import walking

from lobstr_hw.drivers.driver import DeviceEvent
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.poses import PartialPose
from lobstr_hw.simulation import SimulatedTake, TrackingErrors, simulate, take_samples
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

QUIET = replace(TrackingErrors(), jumps_per_minute=0.0, dropouts_per_minute=0.0)


def made_take(seed: int = 5, seconds: float = 1.2, t_pose_s: float = 1.8) -> SimulatedTake:
    """Someone who holds a T-pose and then walks; trackers jitter but are never lost."""
    motion = walking(seconds, seed=seed)
    return simulate(motion, seed=seed, t_pose_s=t_pose_s, errors=QUIET)


def write_log(
    path: Path,
    take: SimulatedTake,
    change: Callable[[Iterable[TrackerSample]], Iterable[TrackerSample]] = iter,
    named: bool = True,
    events: Sequence[DeviceEvent] = (),
) -> Path:
    """A take as a log; ``change`` sees the samples first, ``named`` False leaves roles out."""
    with TrackerLogWriter(path) as log:
        for role, serial in take.serials.items():
            log.add_state(serial, role if named else None, TrackingState.OK, True, 0.0)
        log.add_samples(list(change(take_samples(take))))
        for event in events:
            log.add_event(event)
        for time_s, p in zip(take.truth_times_s, take.truth_p, strict=True):
            log.add_truth(float(time_s), p)
    return path


def without(take: SimulatedTake, role: TrackerRole, path: Path) -> Path:
    """The same log as if a tracker had never been switched on."""
    others = {r: s for r, s in take.serials.items() if r is not role}
    lost = take.serials[role]
    with TrackerLogWriter(path) as log:
        for r, serial in others.items():
            log.add_state(serial, r, TrackingState.OK, True, 0.0)
        log.add_samples([s for s in take_samples(take) if s.serial != lost])
    return path


def with_nan(samples: Iterable[TrackerSample], serial: str, time_s: float) -> list[TrackerSample]:
    """One sample of a tracker, the first at or after a time, is broken."""
    out, done = [], False
    for sample in samples:
        if not done and sample.serial == serial and sample.time_s >= time_s:
            pose = PartialPose(sample.T_world_tracker.R, np.full(3, np.nan))
            sample, done = replace(sample, T_world_tracker=pose), True
        out.append(sample)
    return out
