"""Simulated people who are led through the wizard, on a virtual clock.

They do as they hear: raise their arms when they are asked to, hold them until the wizard has what
it wants, then move, each in their own way and at their own pace, and never press anything.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lobstr_hw.drivers.driver import DeviceInfo
from lobstr_hw.motion import Motion
from lobstr_hw.poses import PartialPose
from lobstr_hw.runtime.wizard.flow import Wizard
from lobstr_hw.runtime.wizard.move_freely import MoveFreely
from lobstr_hw.runtime.wizard.plan import steps_for_a_person
from lobstr_hw.runtime.wizard.run import TURN_S
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.runtime.wizard.stand_still import StandStill
from lobstr_hw.runtime.wizard.take_t_pose import TakeTPose
from lobstr_hw.simulation import (
    Habits,
    PoseDeviation,
    SimulatedTake,
    Sway,
    calibrating_movement,
    simulate,
)
from lobstr_hw.simulation.mishaps import arms_off_level
from lobstr_hw.simulation.t_pose import t_pose_motion
from lobstr_hw.simulation.transitions import joined
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample, TrackingState

MOTION_HZ = 45.0
LONG_S = 18.0  # a pose can be held so long
WHOLE_S = 42.0
STEP_S = 1.2  # arms and feet, from one pose into the next
GIVE_UP_S = 12.0  # what was not accepted for so long will not be


@dataclass
class Actor:
    """Somebody who does as told.

    Attributes:
        seed: of body, mounts, errors and all else.
        standing, t_pose, movement: what they do, one after the other.
        mishap: what is done to their trackers; told when the T-pose is reached.
        settled: the same as if it had been so all along; for mishaps that come and stay.
        order: what the devices say they are; the truth has FOUR_POINTS.
        reactions_s: until the arms go up, and until they move, after they were asked to.
    """

    seed: int
    standing: Motion
    t_pose: Motion
    movement: Motion
    mishap: Callable[[SimulatedTake, float], SimulatedTake] = lambda take, reached_s: take
    settled: Callable[[SimulatedTake, float], SimulatedTake] | None = None
    order: Sequence[TrackerRole] = FOUR_POINTS
    reactions_s: tuple[float, float] = (0.0, 0.0)

    @staticmethod
    def drawn(
        seed: int, change: Callable[[PoseDeviation], PoseDeviation] = lambda own: own
    ) -> "Actor":
        """Somebody who does it right, but for what ``change`` does to the T-pose."""
        reacting = np.random.default_rng([seed, 20])
        pose_rng, standing_rng = (np.random.default_rng([seed, k]) for k in (4, 12))
        deviation = change(PoseDeviation.drawn(pose_rng, np.deg2rad(10.0)))
        hanging = np.deg2rad(standing_rng.normal(-72.0, 5.0, 2))
        at_ease = arms_off_level(
            PoseDeviation.drawn(standing_rng, np.deg2rad(7.0)),
            (float(hanging[0]), float(hanging[1])),
        )
        habits = Habits.drawn(np.random.default_rng([seed, 6]))
        return Actor(
            seed,
            t_pose_motion(LONG_S, MOTION_HZ, at_ease, Sway(), standing_rng),
            t_pose_motion(LONG_S, MOTION_HZ, deviation, Sway(), pose_rng),
            calibrating_movement(habits, np.random.default_rng([seed, 7])),
            reactions_s=(float(reacting.uniform(0.8, 2.0)), float(reacting.uniform(0.4, 1.2))),
        )

    def take(self, arms_up_s: float | None, moves_s: float | None) -> SimulatedTake:
        """All that they will have done, if they begin with each part at these times.

        What was before such a time is the same whatever comes after: so the play goes on where it
        was.
        """
        parts = [first(self.standing, arms_up_s)]
        reached_s = np.inf
        if arms_up_s is not None:
            reached_s = arms_up_s + STEP_S
            parts.append(first(self.t_pose, None if moves_s is None else moves_s - reached_s))
        if moves_s is not None:
            parts += [self.movement, self.standing]
        whole = parts[0] if len(parts) == 1 else joined(parts, STEP_S)
        n = round(WHOLE_S * MOTION_HZ)
        whole = _padded(whole, n)
        take = simulate(whole, self.seed, rate_hz=MOTION_HZ, t_pose_s=0.0)
        return self.mishap(take, reached_s)


def first(motion: Motion, seconds: float | None) -> Motion:
    """The first seconds of a motion."""
    if seconds is None:
        return motion
    return _cut(motion, max(2, round(seconds * MOTION_HZ)))


def _cut(motion: Motion, n: int) -> Motion:
    return replace(
        motion, p_hips=motion.p_hips[:n], R_local=motion.R_local[:n], p_toes=motion.p_toes[:n]
    )


def _padded(motion: Motion, n: int) -> Motion:
    """So many frames; the last one stands."""
    i = np.minimum(np.arange(n), len(motion) - 1)
    return replace(
        motion, p_hips=motion.p_hips[i], R_local=motion.R_local[i], p_toes=motion.p_toes[i]
    )


def _samples(take: SimulatedTake, after_s: float) -> Iterator[TrackerSample]:
    """Those after a time, oldest first."""
    serials = [take.serials[role] for role in FOUR_POINTS]
    for i in range(int(np.searchsorted(take.times_s, after_s, side="right")), len(take.times_s)):
        for k, serial in enumerate(serials):
            tracked = bool(take.tracked[i, k])
            state = TrackingState.OK if tracked else TrackingState.OCCLUDED
            pose = PartialPose(take.R[i, k], take.p[i, k])
            yield TrackerSample(serial, pose, float(take.times_s[i]), tracked, state)


@dataclass
class Played:
    """How it went, and when.

    Attributes:
        person: what the wizard made of them.
        take: what they did.
        ready_s: devices found, the person stands ready.
        reached_s: the arms are up.
        posed_s: the T-pose was taken.
        done_s: all was done; never where it was not.
        refused: reason of the first refusal; empty without.
        stuck: the step that was never done, and what was said; empty where all were.
        samples: all that the wizard was given.
        instructions: all that it showed.
    """

    person: Person
    take: SimulatedTake
    ready_s: float = np.inf
    reached_s: float = np.inf
    posed_s: float = np.inf
    done_s: float = np.inf
    refused: str = ""
    stuck: str = ""
    samples: list[TrackerSample] = field(default_factory=list)
    instructions: set[str] = field(default_factory=set)


class Play:
    """Somebody in front of the wizard; what they do follows from what they hear."""

    def __init__(self, actor: Actor) -> None:
        self.actor = actor
        self.wizard = Wizard(Person(), steps_for_a_person())
        self.out = Played(self.wizard.person, actor.take(None, None))
        take = self.out.take
        self._devices = [
            DeviceInfo(take.serials[true], "tracker", role_hint=said)
            for true, said in zip(FOUR_POINTS, actor.order, strict=True)
        ]
        self._arms_up_s: float | None = None
        self._go_on(0.0, take)

    def _go_on(self, now_s: float, take: SimulatedTake) -> None:
        self.out.take = take
        self._feed = _samples(take, now_s)
        self._waiting = next(self._feed, None)

    def run(self) -> Played:
        """Until it is done, refused, or stuck."""
        now_s, since_s = 0.0, 0.0
        while now_s < WHOLE_S - TURN_S and not self.wizard.done:
            now_s += TURN_S
            stage = self.wizard.stage
            self.wizard.add(now_s, self._due(now_s), (), self._devices)
            self.out.instructions.add(self.wizard.stage.instruction)
            if self.wizard.refusals:
                self.out.refused = self.wizard.refusals[0]
                return self.out
            if self.wizard.stage is not stage:
                since_s = now_s
                self._react(now_s, self.wizard.stage)
            elif now_s - since_s > GIVE_UP_S and not isinstance(stage, MoveFreely):
                break
        if self.wizard.done:
            self.out.done_s = now_s
        else:
            self.out.stuck = f"{self.wizard.stage.title}: {self.wizard.stage.advice()}"
        return self.out

    def _due(self, now_s: float) -> list[TrackerSample]:
        due = []
        while self._waiting is not None and self._waiting.time_s <= now_s:
            due.append(self._waiting)
            self._waiting = next(self._feed, None)
        self.out.samples += due
        return due

    def _react(self, now_s: float, stage: Stage) -> None:
        if isinstance(stage, StandStill):
            self.out.ready_s = now_s
        elif isinstance(stage, TakeTPose):
            self._arms_up_s = now_s + self.actor.reactions_s[0]
            self.out.reached_s = self._arms_up_s + STEP_S
            self._go_on(now_s, self.actor.take(self._arms_up_s, None))
        elif isinstance(stage, MoveFreely):
            self.out.posed_s = now_s
            self._go_on(now_s, self.actor.take(self._arms_up_s, now_s + self.actor.reactions_s[1]))
