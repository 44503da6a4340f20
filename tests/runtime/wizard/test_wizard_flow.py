"""The wizard as a machine: no terminal, no sound, no waiting."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from lobstr_hw.calibration.profile import profile_to_json
from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, EventKind
from lobstr_hw.drivers.fake import SERIALS, FakeDriver
from lobstr_hw.errors import CalibrationError, MissingRole, TPoseNotFound
from lobstr_hw.poses import PartialPose
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.wizard.find_devices import CONFIRM_S, FindDevices
from lobstr_hw.runtime.wizard.flow import AGAIN_S, Wizard
from lobstr_hw.runtime.wizard.move_freely import MoveFreely, Part
from lobstr_hw.runtime.wizard.plan import MakeStage
from lobstr_hw.runtime.wizard.stage import Person
from lobstr_hw.runtime.wizard.stand_still import StandStill
from lobstr_hw.runtime.wizard.take_t_pose import TakeTPose
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

TURN_S = 1.0 / 30.0
POSE_STEPS: Sequence[MakeStage] = (FindDevices, StandStill, TakeTPose)

Heard = list[tuple[float, Spoken]]


class Play:
    """A fake person in front of a wizard; time passes as fast as it can."""

    def __init__(
        self,
        steps: Sequence[MakeStage] = POSE_STEPS,
        driver: FakeDriver | None = None,
        countdown_s: float = 0.0,
        without: TrackerRole | None = None,
    ) -> None:
        self.wizard = Wizard(Person(), steps, countdown_s=countdown_s)
        self.heard: Heard = []
        self.now_s = 0.0
        self._driver = driver or FakeDriver(script="calibrate", rate_hz=45.0)
        self._driver.open()
        self._lost = None if without is None else SERIALS[without]

    def run(self, until_s: float, events: Sequence[DeviceEvent] = ()) -> "Play":
        """Until a time, or until it is done; ``events`` come with the first turn."""
        while self.now_s < until_s and not self.wizard.done:
            self.now_s += TURN_S
            samples = [s for s in self._driver.poll(self.now_s) if s.serial != self._lost]
            devices = [d for d in self._driver.devices() if d.serial != self._lost]
            said = self.wizard.add(self.now_s, samples, [*events, *self._driver.events()], devices)
            self.heard += [(self.now_s, spoken) for spoken in said]
            events = ()
        return self

    def begun(self, stage: type) -> float:
        """When a stage begins."""
        while not isinstance(self.wizard.stage, stage):
            assert self.now_s < 20.0, stage
            self.run(self.now_s + TURN_S)
        return self.now_s


def trigger(time_s: float = 0.0) -> DeviceEvent:
    return DeviceEvent(EventKind.BUTTON_DOWN, SERIALS[TrackerRole.LEFT_HAND], time_s, "trigger")


def command(name: str) -> DeviceEvent:
    return DeviceEvent(EventKind.COMMAND, "", 0.0, name)


def test_nobody_need_do_anything_but_stand_there() -> None:
    play = Play().run(20.0)
    assert play.wizard.done
    assert play.now_s < 10.0, "a T-pose is taken within ten seconds of standing ready"
    assert play.wizard.person.calibration is not None


def test_the_same_play_gives_the_same_words_and_the_same_profile() -> None:
    a, b = Play().run(20.0), Play().run(20.0)
    assert a.heard == b.heard
    profiles = [p.wizard.person.calibration for p in (a, b)]
    assert profiles[0] is not None and profiles[1] is not None
    assert profile_to_json(profiles[0]) == profile_to_json(profiles[1])


def test_a_trigger_press_agrees_to_the_roles_at_once() -> None:
    by_itself = Play(driver=FakeDriver()).begun(StandStill)
    pressed = Play(driver=FakeDriver())
    pressed.run(0.5)
    pressed.run(0.6, [trigger()])
    assert isinstance(pressed.wizard.stage, StandStill)
    assert by_itself == pytest.approx(CONFIRM_S, abs=0.1)


@pytest.mark.parametrize("role", FOUR_POINTS)
def test_no_press_leads_past_a_missing_device(role: TrackerRole) -> None:
    play = Play(without=role)
    play.run(1.0)
    play.run(9.0, [trigger()])
    assert isinstance(play.wizard.stage, FindDevices)
    name = role.replace("_", " ")
    assert name in play.wizard.view().advice
    assert any(name in spoken.text and spoken.sound is Sound.TROUBLE for _, spoken in play.heard)
    with pytest.raises(MissingRole, match=role):
        raise play.wizard.failure()


def test_a_device_that_is_there_but_not_tracked_is_told_apart_from_one_that_is_not() -> None:
    wizard = Wizard(Person(), POSE_STEPS)
    with FakeDriver() as driver:
        samples = [replace(s, tracked=False) for s in driver.poll(1.0)]
        wizard.add(1.0, samples, (), driver.devices())
    with pytest.raises(CalibrationError, match="not tracked"):
        raise wizard.failure()


@pytest.mark.parametrize("seed", range(4))
def test_devices_that_say_nothing_are_told_apart_in_any_order(seed: int) -> None:
    order = np.random.default_rng(seed).permutation(4)
    wizard = Wizard(Person(), POSE_STEPS)
    with FakeDriver(named=0) as driver:
        devices = [driver.devices()[i] for i in order]
        for k in range(1, 60):
            wizard.add(k * TURN_S, driver.poll(k * TURN_S), (), devices)
    assert wizard.person.table.roles == {serial: role for role, serial in SERIALS.items()}


def test_devices_that_say_nothing_are_calibrated_to_the_end() -> None:
    driver = FakeDriver(script="point", rate_hz=45.0, named=0)
    play = Play((FindDevices, StandStill, TakeTPose, MoveFreely), driver).run(60.0)
    assert play.wizard.done
    person = play.wizard.person
    assert person.calibration is not None and person.check is not None
    assert person.check.ok
    assert person.calibration.roles == {serial: role for role, serial in SERIALS.items()}
    assert person.refinement is not None and person.refinement.missing == ()


@pytest.mark.parametrize("extra", [0, 2])
def test_whatever_numbers_are_typed_each_role_stays_with_one_device(extra: int) -> None:
    rng = np.random.default_rng(3)
    wizard = Wizard(Person(), POSE_STEPS)
    with FakeDriver() as driver:
        more = [DeviceInfo(f"MORE-{i}", "tracker") for i in range(extra)]
        samples = driver.poll(0.1)
        wizard.add(0.1, samples, (), [*driver.devices(), *more])
        for _ in range(60):
            wizard.press(str(rng.integers(1, 5 + extra)))
            roles = wizard.person.table.roles
            assert sorted(roles.values()) == sorted(FOUR_POINTS)
            wizard.add(0.1, (), (), [*driver.devices(), *more])
            assert wizard.person.table.roles == roles, "hints do not undo what a person chose"


def test_each_device_can_be_given_each_role() -> None:
    wizard = Wizard(Person(), POSE_STEPS)
    with FakeDriver() as driver:
        wizard.add(0.1, driver.poll(0.1), (), driver.devices())
    for number, serial in enumerate(SERIALS.values(), start=1):
        seen = set()
        for _ in FOUR_POINTS:
            wizard.press(str(number))
            seen.add(wizard.person.table.roles[serial])
        assert seen == set(FOUR_POINTS)


def test_an_unknown_number_is_told() -> None:
    wizard = Wizard(Person(), POSE_STEPS)
    (spoken,) = wizard.press("7")
    assert spoken.sound is Sound.TROUBLE
    assert "7" in spoken.text


@pytest.mark.parametrize("seconds", [2.5, 3.0])
def test_a_countdown_stands_before_every_step_that_measures(seconds: float) -> None:
    play = Play((StandStill, TakeTPose), FakeDriver(), countdown_s=seconds)
    t_pose = play.begun(TakeTPose)
    assert t_pose >= seconds
    left = play.wizard.view().countdown_s
    assert left is not None and 0.0 < left <= seconds
    play.run(t_pose + seconds)
    counted = [spoken.text for at, spoken in play.heard if at >= t_pose and spoken.text.isdigit()]
    assert counted == ["3", "2", "1"][-len(counted) :]
    assert len(counted) >= 2


def test_a_press_ends_the_countdown_and_nothing_more() -> None:
    play = Play((StandStill, TakeTPose), FakeDriver(), countdown_s=30.0)
    play.run(1.0)
    play.run(1.1, [trigger()])
    assert play.wizard.view().countdown_s is None
    assert isinstance(play.wizard.stage, StandStill), "the step itself still has to be done"


def test_other_programs_can_lead_through_it() -> None:
    play = Play(driver=FakeDriver())
    play.run(0.5)
    play.run(0.55, [command("calibrate_ready")])
    play.run(0.65, [command("calibrate_ready")])
    assert isinstance(play.wizard.stage, TakeTPose)
    play.run(1.2)
    since_s = play.now_s
    play.run(1.3, [command("calibrate_ready")])
    play.run(20.0)
    t_pose = play.wizard.person.t_pose
    assert t_pose is not None
    assert t_pose.start_s < since_s, "'get ready' does not touch a T-pose that is being taken"


def test_exec_begins_the_t_pose_anew() -> None:
    play = Play((TakeTPose,), FakeDriver())
    play.run(0.8)
    play.run(20.0, [command("calibrate")])
    t_pose = play.wizard.person.t_pose
    assert t_pose is not None
    assert t_pose.start_s >= 0.8


SLIP = np.array([0.0, 0.04, 0.0])


class Slipping(FakeDriver):
    """The left hand's tracker slips by 4 cm while the T-pose is held."""

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        return [self._slipped(sample) for sample in super().poll(now_s)]

    def _slipped(self, sample: TrackerSample) -> TrackerSample:
        pose = sample.T_world_tracker
        if sample.serial != SERIALS[TrackerRole.LEFT_HAND] or sample.time_s < 2.0:
            return sample
        assert pose.p is not None
        return replace(sample, T_world_tracker=PartialPose(pose.R, pose.p + SLIP))


def test_a_wrong_calibration_is_refused_with_the_reason_and_asked_for_again() -> None:
    quick = partial(MoveFreely, parts=[Part("Move.", "Move.", 0.5)])
    play = Play((StandStill, TakeTPose, quick), Slipping())
    play.run(8.0)
    while not any("Once more" in spoken.text for _, spoken in play.heard):
        assert play.now_s < 40.0
        play.run(play.now_s + 1.0)
    (words,) = [spoken for _, spoken in play.heard if "That was not right" in spoken.text]
    assert "left hand tracker moved" in words.text
    assert words.sound is Sound.TROUBLE
    assert play.wizard.person.t_pose is None, "nothing of it is kept"
    with pytest.raises(CalibrationError, match=r"refused.*left_hand"):
        raise play.wizard.failure()


def test_what_the_movement_did_not_show_is_asked_for_once_more() -> None:
    quick = partial(MoveFreely, parts=[Part("Move.", "Move.", 2.5)])
    play = Play((TakeTPose, quick), FakeDriver()).run(30.0)
    assert play.wizard.done
    asked = [spoken.text for _, spoken in play.heard if spoken.text.startswith(("Nod", "Walk"))]
    assert asked, "he sways and does nothing else"


def test_nobody_is_nagged() -> None:
    play = Play((TakeTPose,), driver=FakeDriver(script="gestures"))
    play.run(0.1)
    play._driver.poll(9.0)  # the arms are down from now on
    play.now_s = 9.0
    play.run(32.0)
    assert not play.wizard.done
    times = [at for at, spoken in play.heard if spoken.sound is Sound.TROUBLE]
    assert len(times) >= 2, "but is told"
    assert min(np.diff(times)) >= AGAIN_S - TURN_S
    with pytest.raises(TPoseNotFound):
        raise play.wizard.failure()


@pytest.mark.parametrize("rate_hz", [30.0, 90.0])
def test_bars_are_shares_and_agree_with_the_checks(rate_hz: float) -> None:
    play = Play(driver=FakeDriver(script="calibrate", rate_hz=rate_hz))
    while not play.wizard.done and play.now_s < 20.0:
        play.run(play.now_s + 0.2)
        view = play.wizard.view()
        assert all(0.0 <= bar.share <= 1.0 for bar in view.bars)
        assert all(bar.share >= 0.5 for bar in view.bars if bar.ok)
        assert view.progress is None or 0.0 <= view.progress <= 1.0
    assert all(bar.ok for bar in play.wizard.view().bars)


def test_samples_without_position_or_sense_do_no_harm() -> None:
    bad = [
        TrackerSample("IMU", PartialPose(np.eye(3), None), 0.1, True),
        TrackerSample("NAN", PartialPose(np.eye(3) * np.nan, np.full(3, np.nan)), 0.1, True),
    ]
    play = Play()
    play.wizard.add(0.0, bad, (), ())
    assert play.run(20.0).wizard.done
    assert play.wizard.person.t_pose is not None
    assert set(play.wizard.person.t_pose.serials) == set(SERIALS.values())


@pytest.mark.parametrize("key", ["q", "\x1b"])
def test_keys_stop_it(key: str) -> None:
    wizard = Wizard(Person(), POSE_STEPS)
    wizard.press(key)
    assert wizard.stopped


@pytest.mark.parametrize("key", ["x", "0", "\x00", "é", "²"])
def test_other_keys_do_nothing_bad(key: str) -> None:
    wizard = Wizard(Person(), POSE_STEPS)
    wizard.press(key)
    assert not wizard.stopped
    assert not wizard.done
