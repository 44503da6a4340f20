"""Laws of the tracker log: what is written is read, whatever happens to the file."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.tracker_log import TrackerLogWriter, container, read_log
from lobstr_hw.drivers.tracker_log.messages import (
    event_message,
    nanoseconds,
    read_event,
    seconds,
)
from lobstr_hw.errors import LogFileError
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import from_rotation_vector, geodesic_angle
from lobstr_hw.skeleton import Body, forward_kinematics
from lobstr_hw.skeleton_pose import RoleReport, SkeletonPose
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

SERIALS = ("LHR-1", "LHR-2", "odd/serial name")
STATES = (
    (True, TrackingState.OK),
    (False, TrackingState.OCCLUDED),
    (True, TrackingState.INERTIAL),
    (False, TrackingState.GONE),
)


def random_samples(seed: int, count: int = 40) -> list[TrackerSample]:
    """Oldest first, with every optional part now there and now not."""
    random = np.random.default_rng(seed)
    times = np.cumsum(random.uniform(0.0, 0.02, count)) + random.uniform(0.0, 1e5)

    def maybe(value: Any) -> Any:
        return value if random.random() < 0.5 else None

    return [
        TrackerSample(
            str(random.choice(SERIALS)),
            PartialPose(
                from_rotation_vector(random.normal(size=3)), maybe(random.normal(scale=3.0, size=3))
            ),
            float(time_s),
            *STATES[random.integers(len(STATES))],
            maybe(random.normal(size=3)),
            maybe(random.normal(size=(6, 6))),
        )
        for time_s in times
    ]


def assert_same(a: TrackerSample, b: TrackerSample, start_s: float) -> None:
    assert (a.serial, a.tracked, a.state) == (b.serial, b.tracked, b.state)
    assert a.time_s - start_s == pytest.approx(b.time_s, abs=1.1e-9)
    assert geodesic_angle(a.T_world_tracker.R, b.T_world_tracker.R) < 1e-6
    for x, y, loss in (
        (a.T_world_tracker.p, b.T_world_tracker.p, 0.51e-6),
        (a.velocity, b.velocity, 1e-7),
        (a.covariance, b.covariance, 1e-7),
    ):
        assert (x is None) == (y is None)
        if x is not None and y is not None:
            np.testing.assert_allclose(x, y, atol=loss)


@pytest.mark.parametrize("seed", range(8))
def test_samples_come_back_as_they_went_in(tmp_path: Path, seed: int) -> None:
    samples = random_samples(seed)
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.add_samples(samples)
    log = read_log(tmp_path / "a.mcap")
    assert not log.cut
    back = list(log.samples())
    assert len(back) == len(samples)
    for a, b in zip(samples, back, strict=True):
        assert_same(a, b, log.start_s)


def test_one_by_one_or_many_at_once_is_the_same_file(tmp_path: Path) -> None:
    samples = random_samples(1)
    one, many = tmp_path / "one.mcap", tmp_path / "many.mcap"
    with TrackerLogWriter(one) as writer:
        for sample in samples:
            writer.add_sample(sample)
    with TrackerLogWriter(many) as writer:
        writer.add_samples(samples)
    assert one.read_bytes() == many.read_bytes()


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 4 * 10**14))
def test_reading_a_time_and_writing_it_again_changes_nothing(time_ns: int) -> None:
    assert nanoseconds(seconds(time_ns)) == time_ns


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 10**6), st.sampled_from([45.0, 60.0, 72.0, 90.0, 120.0, 1000.0]))
def test_a_sample_of_a_ticks_time_is_never_newer_than_the_tick(k: int, rate_hz: float) -> None:
    assert seconds(nanoseconds(k / rate_hz)) <= k / rate_hz


def test_a_time_before_zero_is_refused(tmp_path: Path) -> None:
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        sample = TrackerSample("A", PartialPose(np.eye(3), np.zeros(3)), -1.0, tracked=True)
        with pytest.raises(ValueError, match="times start at 0"):
            writer.add_sample(sample)


@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_a_broken_sample_is_kept_as_nan_and_the_rest_goes_on(tmp_path: Path, broken: float) -> None:
    poses = [
        PartialPose(np.eye(3), np.zeros(3)),
        PartialPose(np.eye(3), np.array([0.0, broken, 1.0])),
        PartialPose(np.full((3, 3), broken), np.ones(3)),
        PartialPose(np.eye(3), np.ones(3)),
    ]
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.add_samples([TrackerSample("A", T, 0.1 * i, True) for i, T in enumerate(poses)])
    whole, no_p, no_R, after = read_log(tmp_path / "a.mcap").samples()
    assert no_p.T_world_tracker.p is not None
    np.testing.assert_array_equal(np.isnan(no_p.T_world_tracker.p), [False, True, False])
    assert np.isnan(no_R.T_world_tracker.R).all()
    assert no_p.tracked and no_R.tracked, "the device said so; the gate above judges"
    for sample in (whole, after):
        assert np.isfinite(sample.T_world_tracker.R).all()


def test_every_message_is_json_that_any_parser_reads(tmp_path: Path) -> None:
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.add_samples(random_samples(2))
        writer.add_sample(TrackerSample("N", PartialPose(np.eye(3), np.full(3, np.nan)), 1e6, True))
        writer.add_event(DeviceEvent(EventKind.COMMAND, "", 1.5, "freeze"))
    seen = set()
    with (tmp_path / "a.mcap").open("rb") as stream:
        for schema, _, message in make_reader(stream).iter_messages():
            assert schema is not None
            content = json.loads(message.data, parse_constant=pytest.fail)
            stamp = content["timestamp"]
            assert stamp["sec"] * 10**9 + stamp["nsec"] == message.log_time
            published = json.loads(schema.data)["properties"]
            assert set(content) <= set(published), schema.name
            seen.add(schema.name)
    assert seen == {"foxglove.PoseInFrame", "lobstr.TrackerState", "lobstr.Event"}


def test_an_event_of_a_later_program_is_passed_over() -> None:
    event = DeviceEvent(EventKind.RECENTRED, "", 2.0)
    data = event_message(nanoseconds(2.0), event)
    assert read_event(2.0, data) == event
    assert read_event(2.0, data.replace(b"recentred", b"teleported")) is None


def test_a_state_holds_until_the_next(tmp_path: Path) -> None:
    pose = PartialPose(np.eye(3), np.zeros(3))
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.add_state("A", TrackerRole.PELVIS, TrackingState.OK, True, 0.0, 0.9)
        writer.add_sample(TrackerSample("A", pose, 0.0, True))
        writer.add_sample(TrackerSample("A", pose, 0.1, False, TrackingState.OCCLUDED))
        writer.add_sample(TrackerSample("A", pose, 0.2, False, TrackingState.OCCLUDED))
        writer.add_sample(TrackerSample("A", pose, 0.3, True))
    track = read_log(tmp_path / "a.mcap").tracker("A")
    assert track.role is TrackerRole.PELVIS
    assert [change.time_s for change in track.states] == pytest.approx([0.0, 0.1, 0.3])
    assert {change.device.battery for change in track.states} == {0.9}
    assert track.device_at(0.25).state is TrackingState.OCCLUDED
    assert list(track.tracked) == [True, False, False, True]


def test_a_loss_told_without_a_pose_is_a_sample_at_the_last_pose(tmp_path: Path) -> None:
    pose = PartialPose(np.eye(3), np.array([1.0, 2.0, 3.0]))
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.add_sample(TrackerSample("A", pose, 0.0, True))
        writer.add_state("A", None, TrackingState.OCCLUDED, False, 0.1)
        writer.add_state("A", None, TrackingState.GONE, False, 0.2)
        writer.add_state("A", None, TrackingState.OK, True, 0.5)
        writer.add_sample(TrackerSample("A", pose, 0.5, True))
    samples = list(read_log(tmp_path / "a.mcap").samples())
    told = [(s.time_s, s.tracked, s.state) for s in samples]
    assert told == [
        (0.0, True, TrackingState.OK),
        (0.1, False, TrackingState.OCCLUDED),
        (0.2, False, TrackingState.GONE),
        (0.5, True, TrackingState.OK),
    ]
    for sample in samples:
        np.testing.assert_array_equal(sample.T_world_tracker.p, [1.0, 2.0, 3.0])


def test_truth_profile_t_pose_and_clock_come_back(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    p = random.normal(size=(3, 22, 3))
    R = from_rotation_vector(random.normal(size=(3, 22, 3)))
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.mark_t_pose(10.5, 13.5)
        writer.mark_clock(1.7e9)
        writer.attach_profile(b'{"format": 1}')
        writer.metadata("made", {"seed": "7"})
        writer.add_sample(TrackerSample("A", PartialPose(np.eye(3), p[0, 0]), 10.0, True))
        for i in range(3):
            writer.add_truth(10.0 + i / 45, p[i], R[i])
    log = read_log(tmp_path / "a.mcap")
    assert log.t_pose_s == pytest.approx((0.5, 3.5))
    assert (log.start_s, log.unix_offset_s, log.profile) == (10.0, 1.7e9, b'{"format": 1}')
    assert log.metadata["made"] == {"seed": "7"}
    assert log.truth is not None and log.truth.R_world is not None
    np.testing.assert_allclose(log.truth.times_s, np.arange(3) / 45, atol=2e-9)
    np.testing.assert_allclose(log.truth.p_world, p, atol=3.2e-5)
    assert geodesic_angle(log.truth.R_world, R).max() < 1e-4


def test_the_skeleton_comes_back(tmp_path: Path) -> None:
    random = np.random.default_rng(6)
    body = Body.standard(1, 0.9)
    R = from_rotation_vector(random.normal(size=(1, 22, 3)))
    p_hips = np.array([[0.3, 0.9, -2.0]])
    p, _ = forward_kinematics(R, p_hips, body.offsets)
    pose = SkeletonPose(
        4.0, p, R,
        np.array([[True, False]]), np.array([[False, False]]), np.zeros((1, 22), np.int8),
        {TrackerRole.HEAD: RoleReport("ok", 0.01)},
    )  # fmt: skip
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.add_sample(TrackerSample("A", PartialPose(np.eye(3), np.zeros(3)), 4.0, True))
        writer.add_skeleton(pose)
    skeleton = read_log(tmp_path / "a.mcap").skeleton
    assert skeleton is not None and skeleton.contact is not None
    back, _ = forward_kinematics(skeleton.R_local, skeleton.p_local[:, 0], skeleton.p_local)
    np.testing.assert_allclose(back, p, atol=1e-5)
    assert geodesic_angle(skeleton.R_local, R).max() < 1e-6
    np.testing.assert_array_equal(skeleton.contact, [[True, False]])
    assert skeleton.roles == ({"head": "ok"},)


def test_a_clean_close_compresses_and_leaves_nothing_beside_the_file(tmp_path: Path) -> None:
    writer = TrackerLogWriter(tmp_path / "a.mcap")
    writer.add_samples(random_samples(3, 2000))
    before = (tmp_path / "a.mcap").stat().st_size
    writer.close()
    writer.close()
    assert (tmp_path / "a.mcap").stat().st_size < 0.6 * before
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def test_a_disk_that_fills_while_compressing_leaves_the_whole_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*args: object) -> None:
        raise OSError(28, "No space left on device")

    writer = TrackerLogWriter(tmp_path / "a.mcap")
    writer.add_samples(random_samples(4))
    monkeypatch.setattr(container, "replace_file", full)
    with pytest.raises(OSError, match="No space left"):
        writer.close()
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    log = read_log(tmp_path / "a.mcap")
    assert not log.cut
    assert sum(map(len, log.trackers)) == len(random_samples(4))


def test_a_missing_file_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(LogFileError, match=r"No such file.*Give the path of a tracker log"):
        read_log(tmp_path / "none.mcap")


def test_another_kind_of_file_says_how_to_make_a_log(tmp_path: Path) -> None:
    path = tmp_path / "clip.bvh"
    path.write_text("HIERARCHY", encoding="utf-8")
    with pytest.raises(LogFileError, match=r"not a tracker log.*lobstr-log make"):
        read_log(path)


def test_a_log_without_trackers_says_what_it_holds(tmp_path: Path) -> None:
    with TrackerLogWriter(tmp_path / "a.mcap") as writer:
        writer.add_truth(0.0, np.zeros((22, 3)))
    with pytest.raises(LogFileError, match=r"no tracker poses .topics seen: /truth"):
        read_log(tmp_path / "a.mcap")


def test_a_place_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    with pytest.raises(LogFileError, match="cannot be written"):
        TrackerLogWriter(tmp_path / "no folder" / "a.mcap")
