"""Errors of the whole program on a made log, at any rate of trackers and loop."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from made_takes import calibrated
from measure_sim import between
from rich.progress import Progress

from lobstr_hw.calibration import save_profile
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.motion import Motion
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.commands.log_make import write_take
from lobstr_hw.runtime.commands.log_report import Step
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.simulation import SimulatedTake, TrackingErrors, simulate
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.skeleton_pose import SkeletonPose

SETTLE_S = 2.5
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]


def session_error(
    predictor: str, motion: Motion, seed: int, tracker_hz: float, loop_hz: float
) -> Array:
    """Errors (ticks,) of a whole session on a log, calibrated alike for every rate."""
    take = simulate(motion, seed, rate_hz=tracker_hz, errors=TrackingErrors.none())
    reference = calibrated(simulate(motion, seed, errors=TrackingErrors.none()))
    with tempfile.TemporaryDirectory() as folder:
        log, profile = Path(folder) / "take.mcap", Path(folder) / "profile.json"
        _write(log, take)
        save_profile(profile, reference)
        options = LiveOptions(
            profile=profile, predictor=predictor, rate_hz=loop_hz, fast=True, quiet=True
        )
        poses: list[SkeletonPose] = []
        with LiveSession(ReplayDriver(log), options, lambda text: None) as live:
            live.outputs.append(_Kept(poses))
            live.run(lambda: False)
    poses = [pose for pose in poses if pose.time_s > take.t_pose_s[1] + SETTLE_S]
    p = np.concatenate([pose.p_world for pose in poses])
    times = np.array([pose.time_s for pose in poses])
    truth = between(times, take.truth_times_s, take.truth_p)
    apart = (p - p[:, :1] - truth + truth[:, :1])[:, TOES]
    return np.asarray(100.0 * np.linalg.norm(apart, axis=-1).mean(-1))


def _write(log: Path, take: SimulatedTake) -> None:
    with Progress(disable=True) as progress:
        write_take(log, take, {}, Step(progress, progress.add_task("")))


@dataclass(frozen=True)
class _Kept:
    """An output that keeps what is shown."""

    poses: list[SkeletonPose]

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Nothing to open."""

    def calibrated(self, body: Body) -> None:
        """Nothing to do."""

    def send(self, pose: SkeletonPose, samples: Sequence[object]) -> None:
        """Keep it."""
        self.poses.append(pose)

    def close(self) -> None:
        """Nothing to close."""
