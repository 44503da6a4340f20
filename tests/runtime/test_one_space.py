from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.calibrations import calibrated
from support.fake_clock import FakeClock
from support.list_driver import ListDriver
from support.made_logs import write_log
from support.two_spaces import held_together

from lobstr_hw.calibration import Calibration, save_profile
from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.calibration.spaces import align_spaces
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter, read_log
from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle, rotation_y
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.one_space import OneSpace, in_one_space, moved
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.runtime.recording import Recorder
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.simulation import SimulatedTake, take_samples
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerRole, TrackerSample

T_WORLD_BELT = Pose(from_rotation_vector(np.array([0.3, 1.9, -0.2])), np.array([1.0, 0.2, -3.0]))
BELT = {"vr": TrackingSpace(), "belt": TrackingSpace(T_WORLD_BELT)}
QUICK = LiveOptions(predictor="standing", quiet=True, duration_s=3.0)


def sample(serial: str, time_s: float) -> TrackerSample:
    pose = PartialPose(rotation_y(time_s), np.array([time_s, 1.0, 0.0]))
    return TrackerSample(serial, pose, time_s, tracked=True)


def two(a: list[TrackerSample], b: list[TrackerSample]) -> ManyDrivers:
    parts = [("vr", ListDriver(a, {"A": None})), ("belt", ListDriver(b, {"B": None}))]
    return ManyDrivers([PartDriver(driver, name) for name, driver in parts])


def test_only_samples_of_the_other_space_are_moved() -> None:
    driver = two([sample("A", 0.1)], [sample("B", 0.2)])
    a, b = in_one_space(driver, BELT, print).poll(1.0)
    assert a.T_world_tracker.p is not None and b.T_world_tracker.p is not None
    np.testing.assert_array_equal(a.T_world_tracker.p, [0.1, 1.0, 0.0])
    np.testing.assert_allclose(b.T_world_tracker.p, T_WORLD_BELT.apply(np.array([0.2, 1.0, 0.0])))
    np.testing.assert_allclose(b.T_world_tracker.R, T_WORLD_BELT.R @ rotation_y(0.2))


@pytest.mark.parametrize("delay_s", [0.03, -0.03])
def test_times_come_together_and_none_is_newer_than_now(delay_s: float) -> None:
    moments = np.arange(1.0, 2.0, 0.01)
    a = [sample("A", t) for t in moments.tolist()]
    b = [sample("B", t + delay_s) for t in moments.tolist()]
    spaces = {"vr": TrackingSpace(), "belt": TrackingSpace(delay_s=delay_s)}
    driver = in_one_space(two(a, b), spaces, print)
    given: list[TrackerSample] = []
    for now_s in np.arange(0.9, 2.2, 0.0173).tolist():
        polled = driver.poll(now_s)
        assert all(s.time_s <= now_s + 1e-12 for s in polled)
        given += polled
    times = {serial: [s.time_s for s in given if s.serial == serial] for serial in "AB"}
    np.testing.assert_allclose(times["A"], times["B"], atol=1e-12)
    assert len(times["A"]) == len(moments)


def test_where_all_is_one_space_the_driver_stays_as_it_is() -> None:
    told: list[str] = []
    driver = two([], [])
    same = {"vr": TrackingSpace(), "belt": TrackingSpace()}
    assert in_one_space(driver, same, told.append) is driver
    fake = FakeDriver()
    assert in_one_space(fake, BELT, told.append) is fake
    assert not told


def test_a_space_that_nobody_joined_is_told() -> None:
    told: list[str] = []
    in_one_space(two([], []), {"vr": TrackingSpace()}, told.append)
    assert len(told) == 1
    assert "belt" in told[0]
    assert "lobstr-calibrate" in told[0]


def test_moving_there_and_back_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(6, 6))
    whole = replace(sample("A", 0.5), velocity=rng.normal(size=3), covariance=root @ root.T)
    back = moved(moved(whole, T_WORLD_BELT, 0.1), T_WORLD_BELT.inverse(), -0.1)
    assert back.time_s == pytest.approx(0.5)
    for name in ("velocity", "covariance"):
        np.testing.assert_allclose(getattr(back, name), getattr(whole, name), atol=1e-12)
    assert back.T_world_tracker.p is not None and whole.T_world_tracker.p is not None
    np.testing.assert_allclose(back.T_world_tracker.p, whole.T_world_tracker.p, atol=1e-12)


def test_a_tracker_without_a_position_is_only_turned() -> None:
    turned = moved(
        replace(sample("A", 0.5), T_world_tracker=PartialPose(np.eye(3), None)), T_WORLD_BELT
    )
    assert turned.T_world_tracker.p is None
    np.testing.assert_array_equal(turned.T_world_tracker.R, T_WORLD_BELT.R)


# a whole session whose pelvis tracker lives in a space of its own


def elsewhere(take: SimulatedTake, T_space_world: Pose, delay_s: float) -> list[TrackerSample]:
    pelvis = take.serials[TrackerRole.PELVIS]
    own = [s for s in take_samples(take) if s.serial == pelvis]
    return [moved(s, T_space_world, delay_s) for s in own]


@pytest.fixture(scope="module")
def profile(take: SimulatedTake) -> Calibration:
    return calibrated(take)


class Joints:
    """An output that keeps the joints of every frame."""

    def __init__(self) -> None:
        self.p_world: list[Array] = []

    def open(self, body: Body, rate_hz: float, take: str) -> None: ...

    def calibrated(self, body: Body) -> None: ...

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        self.p_world.append(pose.p_world[0])

    def close(self) -> None: ...


def body(driver: ManyDrivers | ReplayDriver, path: Path) -> Array:
    """The joints of every frame (frames, 22, 3)."""
    joints = Joints()
    with LiveSession(driver, replace(QUICK, profile=path), print, FakeClock()) as live:
        live.outputs.append(joints)
        live.run(lambda: False)
    return np.array(joints.p_world)


def mixed(take: SimulatedTake, folder: Path, delay_s: float = 0.0) -> ManyDrivers:
    pelvis = take.serials[TrackerRole.PELVIS]
    head = write_log(
        folder / "vr.mcap", take, lambda samples: [s for s in samples if s.serial != pelvis]
    )
    with TrackerLogWriter(folder / "belt.mcap") as log:
        log.add_samples(elsewhere(take, T_WORLD_BELT.inverse(), delay_s))
    return ManyDrivers(
        [
            PartDriver(ReplayDriver(head), "vr"),
            PartDriver(ReplayDriver(folder / "belt.mcap"), "belt", TrackerRole.PELVIS),
        ]
    )


def test_the_body_is_the_same_whichever_space_a_part_is_tracked_in(
    tmp_path: Path, take: SimulatedTake, log: Path, profile: Calibration
) -> None:
    save_profile(tmp_path / "one.json", profile)
    save_profile(tmp_path / "two.json", replace(profile, tracking_spaces=BELT))
    whole = body(ReplayDriver(log), tmp_path / "one.json")
    joined = body(mixed(take, tmp_path), tmp_path / "two.json")
    assert len(whole) == 3 * 45 + 1
    np.testing.assert_allclose(joined, whole, atol=1e-4)
    apart = body(mixed(take, tmp_path), tmp_path / "one.json")
    assert np.abs(apart - whole).max() > 0.5


def test_a_mixed_recording_replays_to_the_same_body(
    tmp_path: Path, take: SimulatedTake, profile: Calibration
) -> None:
    save_profile(tmp_path / "two.json", replace(profile, tracking_spaces=BELT))
    clock = FakeClock(0.0)
    with mixed(take, tmp_path) as driver:
        writer = TrackerLogWriter(tmp_path / "both.mcap")
        recorder = Recorder(driver, writer, RoleTable(None, driver.devices), clock, 90.0)
        recorder.run(lambda: False, 3.5)
        writer.close()
    recorded = read_log(tmp_path / "both.mcap")
    assert set(recorded.metadata["spaces"].values()) == {"vr", "belt"}
    assert recorded.tracker(take.serials[TrackerRole.PELVIS]).role is TrackerRole.PELVIS
    live = body(mixed(take, tmp_path), tmp_path / "two.json")
    again = body(ReplayDriver(tmp_path / "both.mcap"), tmp_path / "two.json")
    np.testing.assert_allclose(live, again, atol=1e-4)


def test_an_alignment_puts_the_trackers_where_they_were() -> None:
    scene = held_together(4, delay_s=0.02)
    space = align_spaces(scene.samples_a, scene.samples_b).space()
    spaces = {"vr": TrackingSpace(), "belt": space}
    driver = two(scene.samples_a, scene.samples_b)
    one = in_one_space(driver, spaces, print)
    assert isinstance(one, OneSpace)
    given = one.poll(100.0)
    a = [s for s in given if s.serial == "A"]
    b = [s for s in given if s.serial == "B"]
    for of_a, of_b in zip(a, b, strict=True):
        assert of_a.time_s == pytest.approx(of_b.time_s, abs=1e-6)
        pose = of_a.T_world_tracker
        assert pose.p is not None and of_b.T_world_tracker.p is not None
        expected = Pose(pose.R, pose.p) @ scene.T_held
        np.testing.assert_allclose(of_b.T_world_tracker.p, expected.p, atol=1e-5)
        assert geodesic_angle(of_b.T_world_tracker.R, expected.R) < 1e-5
