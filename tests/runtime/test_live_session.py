import threading
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.fake_clock import FakeClock
from support.made_logs import with_nan, write_log

from lobstr_hw.calibration import TPoseDetector, calibrate_t_pose
from lobstr_hw.calibration.profile import profile_to_json
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.errors import OutputError
from lobstr_hw.rotations import geodesic_angle
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.outputs.sinks import parse_sink
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.simulation import SimulatedTake, take_samples
from lobstr_hw.skeleton import PARENTS, Body, Joint
from lobstr_hw.skeleton_pose import SkeletonPose, Source
from lobstr_hw.trackers import TrackerRole, TrackerSample

QUICK = LiveOptions(predictor="standing", fast=True, quiet=True)


class Capture:
    """An output that remembers everything."""

    def __init__(self) -> None:
        self.poses: list[SkeletonPose] = []
        self.samples: list[TrackerSample] = []
        self.bodies: list[tuple[int, Body]] = []

    def open(self, body: Body, rate_hz: float, take: str) -> None: ...

    def calibrated(self, body: Body) -> None:
        self.bodies.append((len(self.poses), body))

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        self.poses.append(pose)
        self.samples += samples

    def close(self) -> None: ...


def played(
    path: Path, options: LiveOptions = QUICK, clock: FakeClock | None = None
) -> tuple[LiveSession, Capture, list[str]]:
    told: list[str] = []
    capture = Capture()
    with LiveSession(ReplayDriver(path), options, told.append, clock) as live:
        live.outputs.append(capture)
        live.run(lambda: False)
    return live, capture, told


Played = tuple[LiveSession, Capture, list[str]]


@pytest.fixture(scope="module")
def once(log: Path) -> Played:
    """The log, played for those who only look."""
    return played(log)


def test_a_log_is_carried_through_to_the_end(once: Played, take: SimulatedTake) -> None:
    live, capture, told = once
    n = int(take.times_s[-1] * 45.0 + 1e-6) + 1
    assert not told
    assert [pose.time_s for pose in capture.poses] == [k / 45.0 for k in range(n)]
    assert len(capture.samples) == 4 * len(take.times_s)
    (began, body), *more = capture.bodies
    assert not more
    assert 1.0 < began / 45.0 < 2.5
    for i, pose in enumerate(capture.poses):
        bones = np.linalg.norm(pose.p_world[0, 1:] - pose.p_world[0, PARENTS[1:]], axis=-1)
        own = Body.standard() if i < began else body
        np.testing.assert_allclose(bones, np.linalg.norm(own.offsets[0, 1:], axis=-1), atol=1e-9)
        assert (pose.source == Source.HELD).all() == (i < began)
    summary = live.summary()
    assert summary.frames == n
    assert summary.nonfinite_frames == 0
    assert summary.duration_s == pytest.approx((n - 1) / 45.0, abs=1e-6)
    assert summary.calibrated_at_s == pytest.approx(began / 45.0, abs=1e-6)
    assert summary.bone_length_error_m < 1e-9


def test_hands_and_hips_follow_the_truth(once: Played, take: SimulatedTake) -> None:
    _, capture, _ = once
    truth = {round(float(t), 6): p for t, p in zip(take.truth_times_s, take.truth_p, strict=True)}
    off = [
        np.linalg.norm(pose.p_world[0] - truth[round(pose.time_s, 6)], axis=-1)
        for pose in capture.poses
        if pose.source[0, Joint.HIPS] == Source.TRACKED
    ]
    for joint, within_m in ((Joint.HEAD, 0.05), (Joint.LEFT_HAND, 0.10), (Joint.HIPS, 0.08)):
        assert np.median(off, axis=0)[joint] < within_m


def test_before_the_calibration_a_body_stands_where_the_head_is(once: Played) -> None:
    _, capture, _ = once
    first = capture.poses[0]
    head = capture.samples[0].T_world_tracker.p
    assert head is not None
    np.testing.assert_allclose(first.p_world[0, Joint.HEAD, [0, 2]], head[[0, 2]], atol=0.01)
    assert first.p_world[0, Joint.LEFT_TOES, 1] == pytest.approx(0.02)


def test_real_time_gives_the_same_poses_as_fast(log: Path, once: Played) -> None:
    _, fast, _ = once
    clock = FakeClock()
    began = clock.now_s()
    _, paced, _ = played(log, replace(QUICK, fast=False), clock)
    assert clock.now_s() - began == pytest.approx(fast.poses[-1].time_s, abs=0.03)
    assert len(paced.poses) == len(fast.poses)
    for a, b in zip(paced.poses, fast.poses, strict=True):
        np.testing.assert_array_equal(a.p_world, b.p_world)


@pytest.fixture(scope="module")
def with_legs(log: Path) -> Played:
    """The log, played with the shipped network."""
    return played(log, replace(QUICK, predictor="lobstr"))


@pytest.mark.parametrize("rate_hz", [22.5, 60.0, 90.0])
def test_the_rate_of_the_loop_does_not_change_the_body(
    log: Path, with_legs: Played, rate_hz: float
) -> None:
    _, slow, _ = with_legs
    _, other, _ = played(log, replace(QUICK, predictor="lobstr", rate_hz=rate_hz))
    by_time = {round(pose.time_s, 6): pose for pose in other.poses}
    pairs = [(a, by_time[round(a.time_s, 6)]) for a in slow.poses if round(a.time_s, 6) in by_time]
    pairs = [(a, b) for a, b in pairs if a.time_s > 2.2]
    assert len(pairs) > 15
    upper = range(Joint.HIPS, Joint.LEFT_UPPER_LEG)
    for a, b in pairs:
        # spine, head and arms are of the tick; the legs may lie one grid step behind
        assert geodesic_angle(a.R_local[0, upper], b.R_local[0, upper]).max() < 0.02
        legs = geodesic_angle(a.R_local[0, Joint.LEFT_UPPER_LEG :], b.R_local[0, 14:])
        assert np.median(legs) < 0.2


def test_a_broken_sample_is_counted_and_leaves_no_trace(
    tmp_path: Path, take: SimulatedTake
) -> None:
    serial = take.serials[TrackerRole.LEFT_HAND]
    path = write_log(tmp_path / "nan.mcap", take, lambda s: with_nan(s, serial, 3.0))
    live, capture, _ = played(path)
    assert live.summary().gate_events == {"nonfinite": 1}
    assert live.summary().nonfinite_frames == 0
    assert all(np.isfinite(pose.p_world).all() for pose in capture.poses)


def test_a_lost_tracker_is_reported_and_adds_up(tmp_path: Path, take: SimulatedTake) -> None:
    serial = take.serials[TrackerRole.RIGHT_HAND]

    def lose(samples: Iterable[TrackerSample]) -> list[TrackerSample]:
        return [
            replace(s, tracked=False) if s.serial == serial and s.time_s > 3.0 else s
            for s in samples
        ]

    live, capture, _ = played(write_log(tmp_path / "lost.mcap", take, lose))
    summary = live.summary()
    expected = float(take.times_s[-1]) - 3.0 - 0.1
    assert summary.tracker_loss["right_hand"] == pytest.approx(expected, abs=0.05)
    assert summary.tracker_loss["left_hand"] == 0.0
    assert summary.gate_events == {"untracked": 1}
    assert capture.poses[-1].roles[TrackerRole.RIGHT_HAND].state == "guessed"
    assert capture.poses[-1].source[0, Joint.RIGHT_HAND] == Source.HELD


def test_trackers_without_names_are_told_apart_by_the_t_pose(
    tmp_path: Path, take: SimulatedTake
) -> None:
    path = write_log(tmp_path / "unnamed.mcap", take, named=False)
    live, _, _ = played(path)
    assert live.session.calibrated
    assert dict(live.session.roles) == {serial: role for role, serial in take.serials.items()}


def test_a_profile_in_the_log_is_used_from_the_first_tick(
    tmp_path: Path, take: SimulatedTake
) -> None:
    samples = list(take_samples(take))
    pose = TPoseDetector({s: r for r, s in take.serials.items()}).add(samples)
    assert pose is not None
    path = tmp_path / "own.mcap"
    with TrackerLogWriter(path) as writer:
        writer.attach_profile(profile_to_json(calibrate_t_pose(pose)).encode())
        writer.add_samples(samples)
    _, capture, _ = played(path)
    assert capture.poses[0].source[0, Joint.HIPS] == Source.TRACKED


def test_two_runs_write_the_same_bytes(log: Path, tmp_path: Path) -> None:
    names = ("bvh:out.bvh", "ndjson:out.ndjson", "mcap:out.mcap")
    written = []
    for run in ("a", "b"):
        folder = tmp_path / run
        folder.mkdir()
        specs = [parse_sink(name.replace(":", f":{folder}/")) for name in names]
        played(log, replace(QUICK, predictor="lobstr", outputs=tuple(specs)))
        written.append({f.name: f.read_bytes() for f in sorted(folder.iterdir())})
    assert sorted(written[0]) == ["out.bvh", "out.mcap", "out.ndjson"]
    for name, data in written[0].items():
        assert len(data) > 1000
        assert written[1][name] == data, name


def test_what_a_run_writes_as_a_log_replays_to_the_same_body(log: Path, tmp_path: Path) -> None:
    options = replace(QUICK, outputs=(parse_sink(f"mcap:{tmp_path / 'again.mcap'}"),))
    _, first, _ = played(log, options)
    _, second, _ = played(tmp_path / "again.mcap")
    for a, b in zip(first.poses, second.poses, strict=True):
        np.testing.assert_allclose(a.p_world, b.p_world, atol=1e-5)


def test_devices_need_no_log_and_no_end() -> None:
    capture = Capture()
    options = replace(QUICK, fast=False, duration_s=7.0)
    with LiveSession(FakeDriver(), options, print, FakeClock()) as live:
        live.outputs.append(capture)
        live.run(lambda: False)
    assert len(capture.poses) == 7 * 45 + 1
    assert live.session.calibrated


def test_parts_of_the_body_may_come_from_different_drivers(
    tmp_path: Path, take: SimulatedTake
) -> None:
    pelvis = take.serials[TrackerRole.PELVIS]

    def only(keep: bool) -> Path:
        path = tmp_path / f"{keep}.mcap"
        return write_log(path, take, lambda s: [x for x in s if (x.serial == pelvis) is keep])

    capture = Capture()
    driver = ManyDrivers(
        [PartDriver(ReplayDriver(only(keep)), f"{keep}") for keep in (False, True)]
    )
    with LiveSession(driver, replace(QUICK, duration_s=3.5), print) as live:
        live.outputs.append(capture)
        live.run(lambda: False)
    assert live.session.calibrated
    times = [sample.time_s for sample in capture.samples]
    assert times == sorted(times)


def test_a_stop_before_the_first_tick_is_an_empty_session(log: Path) -> None:
    with LiveSession(ReplayDriver(log), QUICK, print) as live:
        live.run(lambda: True)
    summary = live.summary()
    assert summary.frames == 0
    assert summary.tick_ms == {"p50": None, "p99": None, "max": None}


def test_what_was_open_is_closed_when_a_later_part_fails(log: Path, tmp_path: Path) -> None:
    sinks = (parse_sink(f"ndjson:{tmp_path / 'a'}"), parse_sink(f"bvh:{tmp_path / 'no' / 'b'}"))
    driver = ReplayDriver(log)
    with pytest.raises(OutputError), LiveSession(driver, replace(QUICK, outputs=sinks), print):
        raise AssertionError("it must not get here")
    assert not driver.devices()
    assert str(sinks[0]) not in {thread.name for thread in threading.enumerate()}
