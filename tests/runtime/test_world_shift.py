"""The play space is set up anew in the middle of a session."""

from collections.abc import Sequence

import numpy as np
import pytest

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.fake import SERIALS, FakeDriver
from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle, rotation_y
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.one_space import moved
from lobstr_hw.runtime.world_shift import Shift, ShiftWatch, common_shift
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]
T_NEW_OLD = Pose(rotation_y(2.0), np.array([1.5, 0.12, -0.7]))
SMALL = Pose(rotation_y(0.02), np.array([0.03, 0.0, 0.02]))
AT_S = 4.4
AT = round(AT_S * 45.0)


class Recentred(FakeDriver):
    """From a moment on everything is said in another space; the word of it comes when it likes."""

    def __init__(
        self,
        T: Pose = T_NEW_OLD,
        told_s: float | None = AT_S,
        roles: Sequence[TrackerRole] = FOUR_POINTS,
        script: str = "",
    ) -> None:
        super().__init__(script=script)
        self._T, self._word_s = T, told_s
        self._serials = {SERIALS[role] for role in roles}

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        return [
            moved(s, self._T) if s.time_s >= AT_S and s.serial in self._serials else s
            for s in super().poll(now_s)
        ]

    def events(self) -> Sequence[DeviceEvent]:
        if self._word_s is None or self._now_s < self._word_s:
            return super().events()
        told, self._word_s = DeviceEvent(EventKind.RECENTRED, "", self._word_s), None
        return [told, *super().events()]


class Capture:
    def __init__(self) -> None:
        self.poses: list[SkeletonPose] = []

    def open(self, body: Body, rate_hz: float, take: str) -> None: ...

    def calibrated(self, body: Body) -> None: ...

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        self.poses.append(pose)

    def close(self) -> None: ...


def played(
    driver: FakeDriver, predictor: str = "lobstr"
) -> tuple[LiveSession, Array, list[Spoken]]:
    """The session, all joints (ticks, 22, 3), and what was said."""
    capture, said = Capture(), list[Spoken]()
    options = LiveOptions(predictor=predictor, fast=True, quiet=True, duration_s=6.5)
    with LiveSession(driver, options, lambda _: None, say=said.append) as live:
        live.outputs.append(capture)
        live.run(lambda: False)
    return live, np.array([pose.p_world[0] for pose in capture.poses]), said


def back(p: Array, T: Pose) -> Array:
    """Joints of the moved part in the old space; heights are over the floor in both."""
    level = Pose(T.R, T.p * [1.0, 0.0, 1.0])
    return np.concatenate([p[:AT], level.inverse().apply(p[AT:])])


@pytest.fixture(scope="module")
def undisturbed() -> Array:
    return played(FakeDriver())[1]


@pytest.mark.parametrize("told_s", [AT_S, AT_S - 0.1, AT_S + 0.15])
def test_the_body_goes_on_in_the_new_space_as_if_nothing_had_been(
    undisturbed: Array, told_s: float
) -> None:
    live, p, said = played(Recentred(told_s=told_s))
    words = [spoken.text for spoken in said]
    assert words.count("The play space was set up anew; the body moved along.") == 1
    off = np.linalg.norm(back(p, T_NEW_OLD) - undisturbed, axis=-1)
    assert off[:AT].max() < 1e-9
    if told_s <= AT_S:
        assert off.max() < 0.01, "what a body moves between two samples"
        assert off[:, TOES].max() < 1e-3, "feet that are locked stay where they stand"
    # until a late word came nobody believed the trackers: the body held, and the legs may have
    # taken another step since
    assert off[-45:, :14].max() < 2e-3
    assert live.session.aim.floor_m == pytest.approx(0.12, abs=0.01)


@pytest.mark.parametrize("T", [Pose.identity(), SMALL])
def test_what_is_hardly_a_shift_is_passed_over(T: Pose, undisturbed: Array) -> None:
    _, p, said = played(Recentred(T))
    assert not any("play space" in spoken.text for spoken in said)
    assert np.linalg.norm(p[-1] - undisturbed[-1], axis=-1).max() < 0.1


def test_a_jump_without_a_word_is_no_recentring() -> None:
    live, _, said = played(Recentred(told_s=None), "standing")
    assert not any("play space" in spoken.text for spoken in said)
    assert live.feed.gate.events["jump"] > 0


def test_trackers_that_stay_behind_are_told() -> None:
    hands = (TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND)
    _, _, said = played(Recentred(roles=hands), "standing")
    (spoken,) = [spoken for spoken in said if "play space" in spoken.text]
    assert "not all trackers" in spoken.text
    assert spoken.sound is Sound.TROUBLE


def test_before_a_calibration_there_is_nothing_to_take_along() -> None:
    live, _, _ = played(Recentred(script="gestures", told_s=0.5), "standing")
    assert live.session.calibrated


# the arithmetic


def poses(rng: np.random.Generator, n: int) -> list[Pose]:
    return [Pose(from_rotation_vector(rng.normal(size=3)), rng.normal(size=3)) for _ in range(n)]


@pytest.mark.parametrize("seed", range(4))
def test_a_common_shift_is_found_exactly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    old = poses(rng, 4)
    T = Pose(rotation_y(float(rng.uniform(-3.0, 3.0))), rng.normal(size=3))
    found = common_shift(old, [T @ pose for pose in old])
    assert found is not None
    np.testing.assert_allclose(found.R, T.R, atol=1e-9)
    np.testing.assert_allclose(found.p, T.p, atol=1e-9)


def test_one_tracker_or_several_that_disagree_have_no_common_shift() -> None:
    rng = np.random.default_rng(1)
    old = poses(rng, 4)
    assert common_shift(old[:1], old[:1]) is None
    assert common_shift(old, poses(rng, 4)) is None
    tipped = [Pose(from_rotation_vector(np.array([0.6, 0.0, 0.0])), np.zeros(3)) @ p for p in old]
    assert common_shift(old, tipped) is None, "the vertical stays the vertical"


def test_the_moment_is_found_among_several_samples_of_a_tick() -> None:
    watch = ShiftWatch(lambda serial: TrackerRole(serial))
    rng = np.random.default_rng(2)
    at = dict(zip(FOUR_POINTS, poses(rng, 4), strict=True))

    def say(times: Sequence[float], since_s: float) -> list[TrackerSample]:
        out = []
        for time_s in times:
            for role, pose in at.items():
                T = T_NEW_OLD if time_s >= since_s else Pose.identity()
                now = T @ pose
                out.append(TrackerSample(str(role), PartialPose(now.R, now.p), time_s, True))
        return out

    assert watch.add(1.0, say([0.99, 1.0], 9.0), recentred=False) is Shift.NONE
    found = watch.add(1.02, say([1.01, 1.02], 1.015), recentred=True)
    assert not isinstance(found, Shift)
    T, since_s = found
    assert since_s == 1.02
    assert geodesic_angle(T.R, T_NEW_OLD.R) < 1e-9
    assert watch.add(1.04, say([1.03, 1.04], 0.0), recentred=False) is Shift.NONE, "once"
