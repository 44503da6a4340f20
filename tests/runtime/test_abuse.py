"""Whatever the trackers say, a whole body comes out."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.list_driver import ListDriver

from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array, rotation_y
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.simulation import SimulatedTake, take_samples
from lobstr_hw.skeleton import PARENTS, Body
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerSample, TrackingState


def broken(sample: TrackerSample, kind: int, rng: np.random.Generator) -> TrackerSample:
    """A sample with one of the faults that devices have."""
    R, p = np.array(sample.T_world_tracker.R), sample.T_world_tracker.p
    assert p is not None
    poses: list[tuple[Array, Array | None]] = [
        (R, np.full(3, np.nan)),
        (np.full((3, 3), np.inf), p),
        (np.eye(3), np.zeros(3)),
        (np.zeros((3, 3)), p),
        (R, p + rng.normal(scale=5.0, size=3)),
        (rotation_y(rng.uniform(1.0, 3.0)) @ R, p),
        (R, None),
        (R, np.array([1e300, -1e300, 1e300])),
    ]
    if kind < len(poses):
        return replace(sample, T_world_tracker=PartialPose(*poses[kind]))
    if kind == len(poses):
        return replace(sample, tracked=False, state=TrackingState.GONE)
    return replace(sample, time_s=(np.nan, sample.time_s - 0.5)[kind % 2])


class Capture:
    def __init__(self) -> None:
        self.poses: list[SkeletonPose] = []

    def open(self, body: Body, rate_hz: float, take: str) -> None: ...

    def calibrated(self, body: Body) -> None: ...

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        self.poses.append(pose)

    def close(self) -> None: ...


@pytest.mark.parametrize("seed", range(3))
def test_faults_of_all_kinds_leave_a_finite_body_of_constant_bones(
    seed: int, take: SimulatedTake
) -> None:
    rng = np.random.default_rng(seed)
    samples = [
        broken(sample, int(rng.integers(11)), rng)
        if sample.time_s > take.t_pose_s[1] and rng.random() < 0.3
        else sample
        for sample in take_samples(take)
    ]
    driver = ListDriver(samples, {serial: role for role, serial in take.serials.items()})
    options = LiveOptions(fast=True, quiet=True, duration_s=float(take.times_s[-1]))
    capture = Capture()
    with LiveSession(driver, options, print) as live:
        live.outputs.append(capture)
        live.run(lambda: False)
    assert live.session.calibrated
    assert live.session.nonfinite_frames == 0
    assert live.feed.gate.events.keys() >= {"nonfinite", "zero_pose", "jump", "spin", "untracked"}
    lengths = np.linalg.norm(live.session.body.offsets[0, 1:], axis=-1)
    for pose in capture.poses[-60:]:
        assert np.isfinite(pose.R_local).all()
        bones = np.linalg.norm(pose.p_world[0, 1:] - pose.p_world[0, PARENTS[1:]], axis=-1)
        np.testing.assert_allclose(bones, lengths, atol=1e-6)
    assert driver.closed


def test_when_everything_is_silent_the_body_holds(take: SimulatedTake) -> None:
    end_s = float(take.times_s[-1])
    driver = ListDriver(list(take_samples(take)), {s: r for r, s in take.serials.items()})
    options = LiveOptions(predictor="standing", fast=True, quiet=True, duration_s=end_s + 2.0)
    capture = Capture()
    with LiveSession(driver, options, print) as live:
        live.outputs.append(capture)
        live.run(lambda: False)
    a, b = capture.poses[-2:]
    assert {report.state for report in b.roles.values()} == {"missing"}
    np.testing.assert_allclose(a.p_world, b.p_world, atol=1e-9)
    assert live.summary().tracker_loss["pelvis"] == pytest.approx(1.9, abs=0.05)
