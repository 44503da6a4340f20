"""Two tracking systems are joined by the wizard, and then there is one world."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.list_driver import ListDriver
from support.two_fakes import two_fakes
from support.two_spaces import Scene, held_together

from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.fake import OTHER_SPACE, FakeDriver
from lobstr_hw.errors import SpacesNotJoined
from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.rotations import geodesic_angle
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.one_space import OneSpace, spaces_apart
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.runtime.wizard.flow import Wizard
from lobstr_hw.runtime.wizard.join_spaces import JoinSpaces
from lobstr_hw.runtime.wizard.plan import steps_for_a_person, steps_to_join
from lobstr_hw.runtime.wizard.stage import Person
from lobstr_hw.simulation import TrackingErrors
from lobstr_hw.trackers import TrackerSample

TURN_S = 1.0 / 30.0
KNOWN = {"belt": TrackingSpace(Pose(np.eye(3), np.array([9.0, 0.0, 0.0])))}
LIGHTHOUSE = TrackingErrors()


def two(a: Sequence[TrackerSample], b: Sequence[TrackerSample]) -> OneSpace:
    parts = [("vr", ListDriver(a, {"A": None})), ("belt", ListDriver(b, {"B": None}))]
    world = spaces_apart(ManyDrivers([PartDriver(driver, name) for name, driver in parts]))
    assert world is not None
    return world


def run(world: OneSpace, wizard: Wizard, until_s: float) -> list[str]:
    """What was said."""
    heard = []
    for turn in range(1, int(until_s / TURN_S)):
        now_s = turn * TURN_S
        said = wizard.add(now_s, world.poll(now_s), world.events(), world.devices())
        heard += [spoken.text for spoken in said]
        if wizard.done:
            break
    return heard


def joining(scene: Scene, seconds: float = 30.0) -> tuple[OneSpace, Wizard, list[str]]:
    world = two(scene.samples_a, scene.samples_b)
    wizard = Wizard(Person(), steps_to_join(world))
    return world, wizard, run(world, wizard, seconds)


def off_m(found: TrackingSpace, scene: Scene) -> float:
    p_b = scene.T_a_b.inverse().apply(scene.p_mean)
    return float(np.linalg.norm(found.T_world_space.apply(p_b) - scene.p_mean))


def from_second(scene: Scene, begin_s: float, lift: Callable[[float], float]) -> Scene:
    """Tracker b is still elsewhere before a time."""

    def moved(sample: TrackerSample) -> TrackerSample:
        if sample.time_s >= begin_s:
            return sample
        pose = sample.T_world_tracker
        assert pose.p is not None
        p = pose.p + np.array([0.0, lift(sample.time_s), 0.0])
        return replace(sample, T_world_tracker=PartialPose(np.eye(3), p))

    return replace(scene, samples_b=[moved(sample) for sample in scene.samples_b])


@pytest.mark.parametrize("delay_s", [0.0, 0.04, -0.04])
def test_two_trackers_held_together_join_their_spaces(delay_s: float) -> None:
    scene = held_together(3, seconds=12.0, delay_s=delay_s, errors=LIGHTHOUSE)
    world, wizard, heard = joining(scene)
    assert wizard.done
    assert world.apart == ()
    space = world.spaces["belt"]
    assert off_m(space, scene) < 0.015
    assert geodesic_angle(space.T_world_space.R, scene.T_a_b.R) < np.deg2rad(0.5)
    assert space.delay_s == pytest.approx(delay_s, abs=0.002)
    assert "millimetre" in heard[-2]
    assert "good" in heard[-2]


def test_taking_the_trackers_in_hand_first_does_no_harm() -> None:
    scene = held_together(5, seconds=20.0, errors=LIGHTHOUSE)
    late = from_second(scene, 6.0, lambda time_s: 0.1 * np.sin(time_s))
    world, wizard, _ = joining(late)
    assert wizard.done
    assert off_m(world.spaces["belt"], scene) < 0.015


def test_trackers_that_move_apart_are_not_joined_and_the_person_is_told() -> None:
    a, b = held_together(1, seconds=16.0), held_together(2, seconds=16.0)
    world, wizard, heard = joining(replace(a, samples_b=b.samples_b), 16.0)
    assert not wizard.done
    assert world.apart == ("belt",)
    assert any("do not move as one" in words for words in heard)
    with pytest.raises(SpacesNotJoined, match=r"belt are not joined.*Hold one"):
        raise wizard.failure()


def test_a_second_try_needs_no_beginning() -> None:
    apart, together = held_together(1, seconds=14.0), held_together(2, seconds=14.0)
    later = [replace(s, time_s=s.time_s + 14.0) for s in together.samples_a]
    later_b = [replace(s, time_s=s.time_s + 14.0) for s in together.samples_b]
    world = two(apart.samples_a + later, held_together(7, seconds=14.0).samples_b + later_b)
    wizard = Wizard(Person(), steps_to_join(world))
    heard = run(world, wizard, 40.0)
    assert wizard.done
    assert any("do not move as one" in words for words in heard)
    assert off_m(world.spaces["belt"], together) < 0.005


def test_loosely_held_is_usable_and_said_so() -> None:
    scene = held_together(4, seconds=18.0, slip_m=0.01)
    world, wizard, heard = joining(scene)
    assert wizard.done
    assert "usable" in heard[-2]
    assert off_m(world.spaces["belt"], scene) < 0.03
    assert world.spaces["belt"].residual_m > 0.005, "the profile keeps how good it is"


@pytest.mark.parametrize(
    ("axes", "words"), [([0.0, 1.0, 0.0], "all axes"), ([0.0, 0.0, 0.0], "all axes")]
)
def test_turning_too_little_is_told(axes: list[float], words: str) -> None:
    scene = held_together(6, seconds=15.0, axes=np.array(axes))
    _, wizard, heard = joining(scene, 15.0)
    assert not wizard.done
    assert words in heard[-1]
    assert not wizard.view().bars[0].ok


def test_a_space_without_a_tracker_in_sight_is_told() -> None:
    world = two(held_together(1).samples_a, [])
    wizard = Wizard(Person(), steps_to_join(world))
    heard = run(world, wizard, 10.0)
    assert any("no tracker of belt in sight" in words.lower() for words in heard)
    with pytest.raises(SpacesNotJoined, match="no tracker of belt"):
        raise wizard.failure()


def press() -> DeviceEvent:
    return DeviceEvent(EventKind.BUTTON_DOWN, "A", 0.1, "trigger")


def test_a_press_keeps_what_was_known_and_does_nothing_where_nothing_was() -> None:
    for known in (KNOWN, None):
        world = two(held_together(1).samples_a, held_together(1).samples_b)
        wizard = Wizard(Person(), steps_to_join(world, known))
        assert ("last time" in wizard.view().instruction) is (known is not None)
        said = wizard.add(0.1, world.poll(0.1), [press()], world.devices())
        wizard.add(3.0, (), (), world.devices())
        assert wizard.done is (known is not None)
        if known is not None:
            assert "last time" in said[-1].text
            assert world.spaces["belt"] is KNOWN["belt"]


def test_a_third_space_is_joined_to_the_first_two() -> None:
    first = held_together(1, seconds=12.0, delay_s=-0.03)
    second = held_together(1, seconds=12.0, delay_s=0.05)
    c = [replace(s, serial="C") for s in second.samples_b]
    parts = [("vr", first.samples_a, "A"), ("belt", first.samples_b, "B"), ("knee", c, "C")]
    world = spaces_apart(
        ManyDrivers([PartDriver(ListDriver(s, {n: None}), name) for name, s, n in parts])
    )
    assert world is not None
    wizard = Wizard(Person(), steps_to_join(world))
    run(world, wizard, 11.5)
    assert set(world.spaces) == {"vr", "belt"}
    later = [replace(s, time_s=s.time_s + 12.0) for s in (*first.samples_a, *c)]
    for name, serial in (("vr", "A"), ("knee", "C")):
        i = [part.name for part in world._driver.parts].index(name)  # type: ignore[attr-defined]
        own = [s for s in later if s.serial == serial]
        world._driver.parts[i]._driver.left += own  # type: ignore[attr-defined]
    for turn in range(int(11.5 / TURN_S), int(26.0 / TURN_S)):
        wizard.add(turn * TURN_S, world.poll(turn * TURN_S), (), world.devices())
    assert wizard.done
    assert world.spaces["knee"].delay_s == pytest.approx(0.05, abs=1e-3)
    assert off_m(world.spaces["knee"], second) < 1e-3


# the whole way, on two fake systems


def test_somebody_in_two_systems_is_calibrated_in_one_world() -> None:
    with two_fakes() as driver:
        world = spaces_apart(driver)
        assert world is not None
        wizard = Wizard(Person(), [*steps_to_join(world), *steps_for_a_person()])
        run(world, wizard, 60.0)
    assert wizard.done
    T = world.spaces["belt"].T_world_space @ OTHER_SPACE
    np.testing.assert_allclose(T.p, 0.0, atol=1e-3)
    np.testing.assert_allclose(T.R, np.eye(3), atol=1e-3)
    person = wizard.person
    assert person.check is not None and person.check.ok
    assert person.calibration is not None
    with FakeDriver(script="calibrate") as alone:
        one = Wizard(Person(), steps_for_a_person())
        now_s = 0.0
        while not one.done:
            now_s += TURN_S
            one.add(now_s, alone.poll(now_s), alone.events(), alone.devices())
    assert one.person.calibration is not None
    for serial in one.person.calibration.roles:
        mine, same = (
            p.T_tracker_joint(serial) for p in (person.calibration, one.person.calibration)
        )
        np.testing.assert_allclose(mine.p, same.p, atol=5e-3)
        assert geodesic_angle(mine.R, same.R) < np.deg2rad(1.0)


def test_who_forgets_to_join_is_not_calibrated_wrongly() -> None:
    """The self-check sees a pelvis that is elsewhere."""
    with two_fakes("calibrate") as driver:
        wizard = Wizard(Person(), steps_for_a_person())
        now_s = 0.0
        while now_s < 40.0 and not (wizard.done or wizard.refused):
            now_s += TURN_S
            wizard.add(now_s, driver.poll(now_s), driver.events(), driver.devices())
    assert not wizard.done


def test_the_step_is_there_only_for_spaces_apart() -> None:
    with FakeDriver() as driver:
        assert spaces_apart(driver) is None
        assert spaces_apart(ManyDrivers([PartDriver(driver, "fake")])) is None
    assert steps_to_join(None) == []
    world = two([], [])
    (make,) = steps_to_join(world)
    assert isinstance(make(Person()), JoinSpaces)
