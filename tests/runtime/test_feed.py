import math

import numpy as np

from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import rotation_y
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

HEAD, LEFT, RIGHT, PELVIS = FOUR_POINTS
SERIALS = {"A": HEAD, "B": LEFT, "C": RIGHT, "D": PELVIS}


def feed() -> Feed:
    return Feed(FOUR_POINTS, RoleTable(SERIALS, lambda: ()))


def sample(serial: str, time_s: float, x: float = 1.0, tracked: bool = True) -> TrackerSample:
    pose = PartialPose(rotation_y(0.2), np.array([x, 1.0, 0.0]))
    return TrackerSample(serial, pose, time_s, tracked)


def test_samples_of_trackers_without_a_role_are_left_alone() -> None:
    some = feed()
    some.add([sample("X", 0.0), sample("A", 0.0)])
    assert some.seen((HEAD,))
    assert not some.seen((LEFT,))
    assert not some.gate.events


def test_a_role_is_ok_then_guessed_then_missing() -> None:
    some = feed()
    some.add([sample("A", k / 90.0) for k in range(10)])
    assert some.report(0.1)[HEAD].state == "ok"
    some.add([sample("A", k / 90.0, tracked=False) for k in range(10, 40)])
    report = some.report(39 / 90.0)[HEAD]
    assert report.state == "guessed"
    assert report.age_s == 39 / 90.0 - 0.1
    assert some.report(2.0)[HEAD].state == "missing"
    assert some.report(0.0)[LEFT].age_s == math.inf


def test_a_role_never_heard_of_lies_at_the_pelvis_and_is_not_valid() -> None:
    some = feed()
    some.add([sample("D", 0.0, x=3.0), sample("A", 0.0, x=3.1)])
    seen = some.at((0.0,))
    np.testing.assert_array_equal(seen.p[0, FOUR_POINTS.index(LEFT)], [3.0, 1.0, 0.0])
    assert seen.valid_p[0].tolist() == [True, False, False, True]


def test_the_head_is_known_once_it_was_seen() -> None:
    some = feed()
    assert some.head(0.0) is None
    some.add([sample("A", 0.0, x=0.7)])
    head = some.head(5.0)
    assert head is not None
    np.testing.assert_array_equal(head, [0.7, 1.0, 0.0])
    assert Feed((TrackerRole.PELVIS,), RoleTable(SERIALS, lambda: ())).head(0.0) is None
