"""Which steps a calibration has."""

from collections.abc import Callable, Mapping
from functools import partial

from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.runtime.one_space import OneSpace
from lobstr_hw.runtime.wizard.find_devices import CONFIRM_S, FindDevices
from lobstr_hw.runtime.wizard.join_spaces import JoinSpaces
from lobstr_hw.runtime.wizard.move_freely import MoveFreely, WatchMovement
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.runtime.wizard.stand_still import StandStill
from lobstr_hw.runtime.wizard.take_t_pose import TakeTPose
from lobstr_hw.runtime.wizard.touch_floor import TouchFloor

__all__ = ["steps_for_a_log", "steps_for_a_person", "steps_to_join"]

MakeStage = Callable[[Person], Stage]


def steps_for_a_person(
    *, floor_clearance_m: float | None = None, confirm: bool = True
) -> list[MakeStage]:
    """Devices, floor (if wanted), standing still, T-pose, movement.

    Args:
        floor_clearance_m: from the floor to a controller that touches it; None leaves the step out.
        confirm: give time to object to the roles.
    """
    steps: list[MakeStage] = [partial(FindDevices, confirm_s=CONFIRM_S if confirm else 0.0)]
    if floor_clearance_m is not None:
        steps.append(partial(TouchFloor, clearance_m=floor_clearance_m))
    return [*steps, StandStill, TakeTPose, MoveFreely]


def steps_for_a_log(*, floor_clearance_m: float | None = None) -> list[MakeStage]:
    """A recording cannot be asked to wait: only what gives numbers."""
    if floor_clearance_m is None:
        return [TakeTPose, WatchMovement]
    return [partial(TouchFloor, clearance_m=floor_clearance_m), TakeTPose, WatchMovement]


def steps_to_join(
    world: OneSpace | None, known: Mapping[str, TrackingSpace] | None = None
) -> list[MakeStage]:
    """One for each tracking space that is not the world's; before everything else.

    Args:
        world: the driver; None where it has a single space.
        known: spaces as they were found before; they can be kept by a press.
    """
    if world is None:
        return []
    return [
        partial(JoinSpaces, world=world, name=name, known=(known or {}).get(name))
        for name in world.apart
    ]
