"""The floor is where a controller touches it, and nowhere else."""

import numpy as np
import pytest

from lobstr_hw.drivers.fake import SERIALS
from lobstr_hw.poses import PartialPose
from lobstr_hw.runtime.wizard.stage import Person
from lobstr_hw.runtime.wizard.touch_floor import TouchFloor
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

HEAD, LEFT, RIGHT, PELVIS = FOUR_POINTS
STANDING = {HEAD: 1.6, LEFT: 0.75, RIGHT: 0.75, PELVIS: 1.0}
BENT = {HEAD: 1.0, LEFT: 0.6, RIGHT: 0.04, PELVIS: 0.75}
SEATED = {HEAD: 1.15, LEFT: 0.45, RIGHT: 0.45, PELVIS: 0.6}


def played(
    *parts: tuple[float, dict[TrackerRole, float]],
    zero_m: float = 0.0,
    press_at_s: float | None = None,
    shake_m: float = 0.0,
    clearance_m: float = 0.03,
) -> tuple[bool, Person, TouchFloor]:
    """Somebody who stays at these heights (over the real floor), one after the other."""
    person, rng = Person(), np.random.default_rng(1)
    person.table.roles.update({serial: role for role, serial in SERIALS.items()})
    stage = TouchFloor(person, clearance_m)
    k = 0
    for seconds, heights in parts:
        for _ in range(int(seconds * 30)):
            k += 1
            now_s = k / 30.0
            samples = [
                TrackerSample(
                    SERIALS[role],
                    PartialPose(
                        np.eye(3),
                        np.array([0.0, y + zero_m, 0.0]) + shake_m * rng.normal(size=3),
                    ),
                    now_s,
                    True,
                )
                for role, y in heights.items()
            ]
            pressed = press_at_s is not None and abs(now_s - press_at_s) < 0.01
            if stage.add(now_s, samples, SERIALS[RIGHT] if pressed else None):
                return True, person, stage
    return False, person, stage


@pytest.mark.parametrize("zero_m", [0.0, -1.6, 0.3])
@pytest.mark.parametrize("clearance_m", [0.0, 0.03, 0.08])
def test_wherever_zero_is_the_floor_is_found(zero_m: float, clearance_m: float) -> None:
    touching = {**BENT, RIGHT: clearance_m}
    done, person, _ = played(
        (2.0, STANDING), (2.0, touching), zero_m=zero_m, clearance_m=clearance_m
    )
    assert done
    assert person.floor_m == pytest.approx(zero_m, abs=1e-6)


@pytest.mark.parametrize("pose", [STANDING, SEATED])
def test_hanging_hands_are_no_floor(pose: dict[TrackerRole, float]) -> None:
    assert not played((3.0, STANDING), (5.0, pose))[0]


def test_a_controller_that_moves_is_not_taken_by_itself_but_on_a_press() -> None:
    assert not played((2.0, STANDING), (3.0, BENT), shake_m=0.03)[0]
    assert played((2.0, STANDING), (3.0, BENT), shake_m=0.03, press_at_s=4.0)[0]


def test_a_press_in_the_air_is_answered_with_what_to_do() -> None:
    done, _, stage = played((4.0, STANDING), press_at_s=3.0)
    assert not done
    assert "floor" in stage.advice()
