"""Simulated people who do something wrong in the wizard, or to whom it happens."""

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations

import numpy as np
from self_check_table import GESTURES_S
from wizard_actor import LONG_S, Actor, first

from lobstr_hw.simulation import PoseDeviation, SimulatedTake
from lobstr_hw.simulation.mishaps import any_direction, arms_off_level, seated, slipped, unseen
from lobstr_hw.trackers import FOUR_POINTS

SLIP_S = (0.3, 1.7)  # after the arms are up; the pose is taken from about 0.2 to 1.7 s
GOOD = "good"


def _rng(seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, 11])


def exchanged(seed: int) -> Actor:
    """Devices that say they are something else: any wrong order of the four roles."""
    wrong = list(permutations(FOUR_POINTS))[1:]
    return replace(Actor.drawn(seed), order=wrong[int(_rng(seed).integers(len(wrong)))])


def sitting(seed: int) -> Actor:
    """On a chair or stool, until asked to move."""
    actor, hips = Actor.drawn(seed), _rng(seed).uniform(0.50, 0.68)
    return replace(actor, standing=seated(actor.standing, hips), t_pose=seated(actor.t_pose, hips))


def staying_seated(seed: int) -> Actor:
    """The same all along: of the movement only what can be done on a chair."""
    actor, hips = sitting(seed), _rng(seed).uniform(0.50, 0.68)
    return replace(actor, movement=seated(first(actor.movement, GESTURES_S), hips))


def arms(seed: int) -> Actor:
    """One arm or both, up or down, 30 to 60 degrees from level."""
    rng = _rng(seed)
    up = np.deg2rad(rng.uniform(30.0, 60.0, 2)) * rng.choice([-1.0, 1.0], 2)
    which = int(rng.integers(3))
    left, right = (up[0] if which != 1 else 0.0), (up[1] if which != 0 else 0.0)

    def change(own: PoseDeviation) -> PoseDeviation:
        straight = np.where([[left != 0.0], [right != 0.0]], 0.0, own.arms)
        return arms_off_level(replace(own, arms=straight), (left, right))

    return Actor.drawn(seed, change)


def slip(seed: int, shift_m: float, turn_rad: float) -> Actor:
    """A tracker moves on its joint while the T-pose is held."""
    rng = _rng(seed)
    tracker, after_s, lasts_s = int(rng.integers(4)), rng.uniform(*SLIP_S), rng.uniform(0.05, 0.3)
    shift, turn = any_direction(rng, shift_m), any_direction(rng, turn_rad)

    def at(take: SimulatedTake, when_s: float) -> SimulatedTake:
        return slipped(take, tracker, when_s, shift=shift, turn=turn, lasts_s=lasts_s)

    def mishap(take: SimulatedTake, reached_s: float) -> SimulatedTake:
        return take if reached_s == np.inf else at(take, reached_s + after_s)

    return replace(Actor.drawn(seed), mishap=mishap, settled=lambda take, _: at(take, -LONG_S))


def unseen_tracker(seed: int) -> Actor:
    """From the beginning, or from when the arms are up."""
    tracker = int(_rng(seed).integers(4))

    def mishap(take: SimulatedTake, reached_s: float) -> SimulatedTake:
        if seed % 2:
            return unseen(take, tracker)
        tracked = np.array(take.tracked)
        tracked[take.times_s >= reached_s, tracker] = False
        return replace(take, tracked=tracked)

    return replace(Actor.drawn(seed), mishap=mishap)


KINDS: dict[str, Callable[[int], Actor]] = {
    GOOD: Actor.drawn,
    "roles exchanged": exchanged,
    "sitting until the movement": sitting,
    "arms 30 to 60 degrees from level": arms,
    "a tracker moved by 3 cm in the pose": lambda seed: slip(seed, 0.03, 0.0),
    "a tracker turned by 10 degrees in the pose": lambda seed: slip(seed, 0.0, np.deg2rad(10.0)),
    "one tracker not tracked": unseen_tracker,
    "sitting all along": staying_seated,  # last, for the others' seeds
}
