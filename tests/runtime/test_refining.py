"""A recording refined: the live program's frames, with other legs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.made_logs import made_take, without, write_log

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.errors import CalibrationError, LobstrError, LogFileError
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import rotation_y
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.one_space import moved
from lobstr_hw.runtime.outputs.output import Output
from lobstr_hw.runtime.refining import (
    Moment,
    Recording,
    Request,
    Requests,
    refined_poses,
    seen_in,
)
from lobstr_hw.runtime.sources import bundled_log
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.skeleton_pose import Mode, SkeletonPose, Source
from lobstr_hw.trackers import TrackerRole

TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]
LEGS = [
    *(Joint.LEFT_UPPER_LEG, Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT, Joint.LEFT_TOES),
    *(Joint.RIGHT_UPPER_LEG, Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT, Joint.RIGHT_TOES),
]
REST = [joint for joint in Joint if joint not in LEGS]


def quiet(*_: object) -> None:
    """Nobody looks."""


class Kept(Output):
    """Keeps what it is sent."""

    def __init__(self) -> None:
        self.poses: list[SkeletonPose] = []

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Nothing to open."""

    def calibrated(self, body: Body) -> None:
        """Nothing to write."""

    def send(self, pose: SkeletonPose, samples: object) -> None:
        self.poses.append(pose)

    def close(self) -> None:
        """Nothing to close."""


def played_live(log: Path) -> list[SkeletonPose]:
    kept = Kept()
    with LiveSession(ReplayDriver(log), LiveOptions(fast=True, quiet=True), quiet) as live:
        live.outputs.append(kept)
        live.run(lambda: False)
    return kept.poses


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A T-pose and a walk of four seconds."""
    return write_log(tmp_path_factory.mktemp("logs") / "walk.mcap", made_take(seconds=4.0))


@pytest.fixture(scope="module")
def live(log: Path) -> list[SkeletonPose]:
    return played_live(log)


@pytest.fixture(scope="module")
def recording(log: Path) -> Recording:
    return seen_in(log, None, quiet, quiet)


@pytest.fixture(scope="module")
def poses(recording: Recording) -> list[SkeletonPose]:
    return list(refined_poses(recording))


def stacked(poses: list[SkeletonPose], name: str) -> np.ndarray:
    return np.concatenate([getattr(pose, name) for pose in poses])


def test_only_the_legs_differ_from_what_the_live_program_shows(
    live: list[SkeletonPose], poses: list[SkeletonPose]
) -> None:
    assert [pose.time_s for pose in poses] == [pose.time_s for pose in live]
    seen = np.array([(pose.source != Source.HELD).any() for pose in poses])
    assert seen.any() and not seen.all(), "calibrated on the way"
    there, here = (stacked(p, "p_world")[seen] for p in (live, poses))
    np.testing.assert_array_equal(here[:, REST], there[:, REST])
    assert np.abs(here[:, TOES] - there[:, TOES]).max() > 0.01
    assert [pose.roles for pose in poses] == [pose.roles for pose in live]


def test_before_the_calibration_the_user_stands_in_the_own_size(
    live: list[SkeletonPose], poses: list[SkeletonPose], recording: Recording
) -> None:
    scale = recording.body.scale[0]
    assert scale != 1.0
    there, here = live[0].p_world[0], poses[0].p_world[0]
    np.testing.assert_allclose(here[0, [0, 2]], there[0, [0, 2]])
    assert here[0, 1] == pytest.approx(1.0 / scale)
    np.testing.assert_array_equal(poses[0].R_local, live[0].R_local)


def test_feet_change_their_pace_no_more_suddenly_than_live(
    live: list[SkeletonPose], poses: list[SkeletonPose]
) -> None:
    """A seam would be a jump, which is two sudden changes of pace."""
    changes = []
    for some in (live, poses):
        toes = stacked([p for p in some if (p.source != Source.HELD).any()], "p_world")[:, TOES]
        changes.append(np.linalg.norm(np.diff(toes, 2, axis=0), axis=-1))
    assert changes[1].max() < 1.1 * changes[0].max()
    assert changes[1][:30].max() < 1.1 * max(changes[0][:30].max(), 0.005), "where it begins"


def test_the_same_log_gives_the_same_bytes(log: Path, poses: list[SkeletonPose]) -> None:
    again = list(refined_poses(seen_in(log, None, quiet, quiet)))
    for name in ("p_world", "R_local", "contact", "locked"):
        assert stacked(again, name).tobytes() == stacked(poses, name).tobytes()


def test_a_body_that_was_frozen_is_frozen_again(recording: Recording) -> None:
    asked = {150: (Request.FREEZE,), 170: (Request.FREEZE,)}
    moments = tuple(
        replace(moment, asked=asked.get(i, ())) for i, moment in enumerate(recording.moments)
    )
    p = stacked(list(refined_poses(replace(recording, moments=moments))), "p_world")
    moved = np.abs(np.diff(p, axis=0)).max(axis=(1, 2))
    assert (moved[149:169] == 0.0).all()
    assert moved[145:149].all() and moved[170:].all()


def test_a_body_that_was_seated_sits_again(recording: Recording) -> None:
    moments = tuple(
        replace(moment, asked=(Request.SIT,) if i == 100 else ())
        for i, moment in enumerate(recording.moments)
    )
    poses = list(refined_poses(replace(recording, moments=moments)))
    plain = list(refined_poses(recording))
    np.testing.assert_array_equal(stacked(poses[:100], "p_world"), stacked(plain[:100], "p_world"))
    assert all(pose.mode is Mode.SEATED for pose in poses[100:])
    assert not any(pose.mode is Mode.SEATED for pose in plain)


def test_where_the_play_space_is_set_up_anew_the_legs_go_on(
    recording: Recording, tmp_path: Path
) -> None:
    """The same person, said in another space from a moment on, told a little later."""
    since_s = 4.0
    T = Pose(rotation_y(2.0), np.array([1.5, 0.0, -0.7]))
    path = write_log(
        tmp_path / "moved.mcap",
        made_take(seconds=4.0),
        lambda samples: [moved(s, T) if s.time_s >= since_s else s for s in samples],
        events=[DeviceEvent(EventKind.RECENTRED, "", since_s)],
    )
    seen = seen_in(path, None, quiet, quiet)
    (at,) = [i for i, moment in enumerate(seen.moments) if moment.T_new_old is not None]
    assert seen.moments[at].sight.time_s == pytest.approx(since_s, abs=0.03)
    plain = stacked(list(refined_poses(recording)), "p_world")
    p = stacked(list(refined_poses(seen)), "p_world")
    p[at:] = T.inverse().apply(p[at:])
    off = np.linalg.norm(p - plain, axis=-1)
    assert off[:, REST].max() < 0.02, "what a body moves between two samples"
    assert off[:, LEGS].max() < 0.05, "and a foot may be set down a little sooner or later"
    jumps = np.linalg.norm(np.diff(p[at - 20 : at + 20, TOES], axis=0), axis=-1)
    usual = np.linalg.norm(np.diff(plain[at - 20 : at + 20, TOES], axis=0), axis=-1)
    assert jumps.max() < 1.1 * usual.max()


def test_requests_are_noted_and_answered_as_live() -> None:
    requests = Requests()
    assert [requests.freeze(), requests.sit(), requests.freeze()] == [True, True, False]
    assert requests.noted == [Request.FREEZE, Request.SIT, Request.FREEZE]


def test_a_log_without_a_t_pose_or_profile_is_refused(tmp_path: Path) -> None:
    take = made_take(seconds=4.0)
    path = write_log(
        tmp_path / "walk.mcap", take, lambda samples: [s for s in samples if s.time_s > 2.5]
    )
    with pytest.raises(CalibrationError, match="--profile FILE"):
        seen_in(path, None, quiet, quiet)


def test_a_log_without_a_pelvis_is_refused(tmp_path: Path) -> None:
    path = without(made_take(), TrackerRole.PELVIS, tmp_path / "three.mcap")
    with pytest.raises(LobstrError, match="pelvis"):
        seen_in(path, None, quiet, quiet)


def test_too_little_of_the_user_is_told_in_seconds(recording: Recording) -> None:
    begun = next(i for i, m in enumerate(recording.moments) if m.sight.frame is not None)
    short = replace(recording, moments=recording.moments[: begun + 45])
    with pytest.raises(LogFileError, match=r"for 1\.0 s.*needs 2 s.*without --refine"):
        refined_poses(short)


def test_a_moment_is_kept_for_each_tick(recording: Recording, live: list[SkeletonPose]) -> None:
    assert all(isinstance(moment, Moment) for moment in recording.moments)
    assert len(recording.moments) == len(live)


def test_the_demo_log_is_refined_from_end_to_end() -> None:
    """Its last third: somebody walks up, sits down and stands up."""
    recording = seen_in(bundled_log(), None, quiet, quiet)
    last = recording.moments[2 * len(recording.moments) // 3 :]
    p = stacked(list(refined_poses(replace(recording, moments=last))), "p_world")
    assert len(p) == len(last)
    assert np.isfinite(p).all()
    bones = np.linalg.norm(p[:, Joint.LEFT_FOOT] - p[:, Joint.LEFT_LOWER_LEG], axis=-1)
    assert np.ptp(bones) < 1e-9
