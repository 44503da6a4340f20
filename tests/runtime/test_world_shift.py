"""The play space is set up anew in the middle of a session."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from support.fake_clock import FakeClock

from lobstr_hw.drivers.driver import DeviceEvent, EventKind, TrackerDriver
from lobstr_hw.drivers.fake import SERIALS, FakeDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle, rotation_y
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.one_space import moved
from lobstr_hw.runtime.outputs.sinks import SinkSpec
from lobstr_hw.runtime.recording import Recorder
from lobstr_hw.runtime.roles import RoleTable
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
        commands: Sequence[tuple[float, str]] = (),
    ) -> None:
        super().__init__(script=script)
        self._T, self._word_s, self._commands = T, told_s, list(commands)
        self._serials = {SERIALS[role] for role in roles}

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        return [
            moved(s, self._T) if s.time_s >= AT_S and s.serial in self._serials else s
            for s in super().poll(now_s)
        ]

    def events(self) -> Sequence[DeviceEvent]:
        due = [command for command in self._commands if command[0] <= self._now_s]
        self._commands = self._commands[len(due) :]
        asked = [DeviceEvent(EventKind.COMMAND, "", time_s, name) for time_s, name in due]
        return [*self._word(), *asked]

    def _word(self) -> Sequence[DeviceEvent]:
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
    driver: TrackerDriver, predictor: str = "lobstr", outputs: tuple[SinkSpec, ...] = ()
) -> tuple[LiveSession, Array, list[Spoken]]:
    """The session, all joints (ticks, 22, 3), and what was said."""
    capture, said = Capture(), list[Spoken]()
    options = LiveOptions(
        predictor=predictor, fast=True, quiet=True, duration_s=6.5, outputs=outputs
    )
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
    live, _, said = played(Recentred(script="gestures", told_s=0.5), "standing")
    assert live.session.calibrated
    assert not any("body moved along" in spoken.text for spoken in said)


def test_while_nobody_is_calibrated_no_body_is_said_to_have_moved() -> None:
    class Still(Recentred):
        def poll(self, now_s: float) -> Sequence[TrackerSample]:
            return [s for s in super().poll(now_s) if s.time_s > AT_S - 0.3]

    live, _, said = played(Still(script="gestures"), "standing")
    assert not live.session.calibrated
    assert not any("body moved along" in spoken.text for spoken in said)


@pytest.mark.parametrize("command", ["freeze", "seat"])
def test_a_frozen_or_seated_body_is_taken_along(command: str) -> None:
    # on again at once: the way out of what is shown begins in the new space
    commands = [(4.0, command), (4.5, command)]
    _, still, _ = played(Recentred(Pose.identity(), commands=commands), "standing")
    _, p, said = played(Recentred(commands=commands), "standing")
    assert sum("body moved along" in spoken.text for spoken in said) == 1
    assert np.linalg.norm(back(p, T_NEW_OLD) - still, axis=-1).max() < 0.01


# a recording of it


@pytest.mark.parametrize("command", ["live", "record"])
def test_a_recording_is_replayed_with_the_new_play_space(tmp_path: Path, command: str) -> None:
    path = tmp_path / "take.mcap"
    driver = Recentred(told_s=AT_S + 0.1, commands=[(5.5, "freeze")])
    if command == "live":
        played(driver, "standing", outputs=(SinkSpec("mcap", str(path)),))
    else:
        with driver, TrackerLogWriter(path) as writer:
            table = RoleTable(None, driver.devices)
            Recorder(driver, writer, table, FakeClock(0.0), 90.0).run(lambda: False, 6.5)
    _, there, live = played(Recentred(told_s=AT_S + 0.1, commands=[(5.5, "freeze")]), "standing")
    _, again, said = played(ReplayDriver(path), "standing")
    assert [spoken.text for spoken in said] == [spoken.text for spoken in live]
    assert "The play space was set up anew; the body moved along." in {s.text for s in said}
    assert np.abs(again - there[: len(again)]).max() < 1e-3, "a log rounds to micrometres"


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
    assert watch.add(1.06, say([1.05, 1.06], 0.0), recentred=True) is Shift.NONE, "the word twice"
    assert watch.add(1.42, say([1.41, 1.42], 0.0), recentred=False) is Shift.NONE


# trackers that speak at different times, and move

PLACES = {
    TrackerRole.HEAD: np.array([0.1, 1.7, 0.2]),
    TrackerRole.LEFT_HAND: np.array([0.5, 1.2, 0.4]),
    TrackerRole.RIGHT_HAND: np.array([-0.5, 1.2, 0.4]),
    TrackerRole.PELVIS: np.array([0.1, 1.0, 0.2]),
}
EVERY_S = 1.0 / 90.0
SHIFT_S, WORD_S, END_S = 1.0, 1.05, 1.6


def heard(
    T: Pose,
    staying: Sequence[TrackerRole] = (),
    every_s: Mapping[TrackerRole, float] = {},
    phase_s: float = 0.0,
    hidden_s: Mapping[TrackerRole, tuple[float, float]] = {},
    hand_m_s: float = 0.0,
) -> list[Pose | Shift]:
    """What a watch at 45 Hz says of a recentring, but NONE.

    Args:
        T: from the old space to the new one.
        staying: trackers of another system.
        every_s: between two samples; 1/90 where nothing is said.
        phase_s: of the samples.
        hidden_s: from when to when a tracker is out of sight.
        hand_m_s: the right hand's speed.
    """
    samples = []
    for role, place in PLACES.items():
        step_s = every_s.get(role, EVERY_S)
        for time_s in np.arange(0.5 + phase_s * step_s, END_S, step_s).tolist():
            way = hand_m_s * (time_s - SHIFT_S) if role is TrackerRole.RIGHT_HAND else 0.0
            pose = Pose(np.eye(3), place + np.array([0.0, 0.0, way]))
            now = T @ pose if time_s >= SHIFT_S and role not in staying else pose
            begin_s, end_s = hidden_s.get(role, (np.inf, np.inf))
            seen = not begin_s <= time_s < end_s
            samples.append(TrackerSample(str(role), PartialPose(now.R, now.p), time_s, seen))
    samples.sort(key=lambda sample: sample.time_s)
    watch, said, done = ShiftWatch(lambda serial: TrackerRole(serial)), list[Pose | Shift](), 0
    for now_s in np.arange(0.5, END_S, 1.0 / 45.0).tolist():
        begin, done = done, sum(sample.time_s <= now_s for sample in samples)
        found = watch.add(now_s, samples[begin:done], 0.0 <= now_s - WORD_S < 1.0 / 45.0)
        if isinstance(found, Shift):
            said += [found] if found is not Shift.NONE else []
        else:
            said.append(found[0])
    return said


SIDE = Pose(rotation_y(0.6), np.array([0.8, 0.0, -0.3]))
RATES_HZ = (30.0, 60.0, 90.0, 250.0)
PHASES = (0.0, 0.35, 0.7)


@pytest.mark.parametrize("rate_hz", RATES_HZ)
@pytest.mark.parametrize("phase", PHASES)
def test_a_pelvis_of_another_system_stays_behind_at_any_rate(rate_hz: float, phase: float) -> None:
    rates = {TrackerRole.PELVIS: 1.0 / rate_hz}
    assert heard(SIDE, [TrackerRole.PELVIS], rates, phase) == [Shift.APART]


@pytest.mark.parametrize("rate_hz", RATES_HZ)
@pytest.mark.parametrize("phase", PHASES)
def test_the_shift_is_the_same_at_any_rate(rate_hz: float, phase: float) -> None:
    (T,) = heard(SIDE, (), {TrackerRole.PELVIS: 1.0 / rate_hz}, phase)
    assert isinstance(T, Pose)
    np.testing.assert_allclose(T.p, SIDE.p, atol=1e-9)
    assert geodesic_angle(T.R, SIDE.R) < 1e-9


@pytest.mark.parametrize("begin_s", [0.9, 0.97, 0.995])
def test_a_tracker_out_of_sight_for_a_moment_is_waited_for(begin_s: float) -> None:
    hidden = {TrackerRole.PELVIS: (begin_s, 1.09)}
    assert heard(SIDE, [TrackerRole.PELVIS], hidden_s=hidden) == [Shift.APART]
    (T,) = heard(SIDE, hidden_s=hidden)
    assert isinstance(T, Pose)
    np.testing.assert_allclose(T.p, SIDE.p, atol=1e-9)


def test_a_hand_may_move_on_while_it_is_out_of_sight() -> None:
    (T,) = heard(SIDE, hidden_s={TrackerRole.RIGHT_HAND: (0.85, 1.09)}, hand_m_s=1.5)
    assert isinstance(T, Pose)
    np.testing.assert_allclose(T.p, SIDE.p, atol=1e-9)


def test_a_tracker_that_went_out_of_sight_holds_nothing_up() -> None:
    (T,) = heard(SIDE, hidden_s={TrackerRole.LEFT_HAND: (0.95, 9.0)})
    assert isinstance(T, Pose)


@pytest.mark.parametrize("speed_m_s", [1.0, 3.0, 5.0, 6.0, 8.0, 10.0])
@pytest.mark.parametrize("rate_hz", [45.0, 90.0])
def test_a_quick_hand_is_no_new_play_space(speed_m_s: float, rate_hz: float) -> None:
    rates = dict.fromkeys(PLACES, 1.0 / rate_hz)
    assert heard(Pose.identity(), (), rates, 0.5, hand_m_s=speed_m_s) == []


def test_a_hand_that_jumps_by_itself_is_no_shift_of_all() -> None:
    T = Pose(np.eye(3), np.array([0.0, 0.12, 0.0]))
    others = [role for role in PLACES if role is not TrackerRole.RIGHT_HAND]
    assert heard(T, others) == [Shift.APART]
