"""One user's session: calibrated once, then a body every tick."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lobstr_hw.avatar import Avatar
from lobstr_hw.calibration.adjust import in_new_space
from lobstr_hw.calibration.calibration import Calibration
from lobstr_hw.errors import CalibrationError
from lobstr_hw.poses import Pose
from lobstr_hw.predictors.predictor import Frame, Predictor, State
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.changing import Change
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.presenting import Presentation, in_new_world
from lobstr_hw.runtime.standing import standing_pose
from lobstr_hw.runtime.ticks import Tick
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import RoleReport, SkeletonPose
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["Session", "Sight"]

Watcher = Callable[[Sequence[TrackerSample]], Calibration | None]
"""Shown the samples of every tick until it finds a calibration in them."""


LEVEL = np.array([1.0, 0.0, 1.0])
RESTART_AFTER_S = 0.2
"""A state that has given nothing finite for so long is given up."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What a session sees at a tick.

    Attributes:
        time_s: of the tick.
        roles: how the trackers fare.
        frame: joint poses at that time; None while there is no calibrated user in sight.
        grid: joint poses at the grid times due by it, oldest first.
        p_head: (3,) of the headset while there is no frame; None before it was seen.
    """

    time_s: float
    roles: dict[TrackerRole, RoleReport]
    frame: Frame | None = None
    grid: tuple[Frame, ...] = ()
    p_head: Array | None = None


class Session:
    """Calibration, avatar and its state.

    Attributes:
        body: the user's sizes; the standard body before the first calibration.
        calibration: None before the first.
        presentation: what is shown instead of the body as computed (frozen, seated).
        nonfinite_frames: poses that were not finite and were replaced by the last good one.
    """

    _avatar: Avatar
    _state: State

    def __init__(
        self,
        predictor: Predictor,
        watch: Watcher,
        calibration: Calibration | None = None,
        *,
        rate_hz: float,
        input_delay_s: float,
    ) -> None:
        """Begin before the first tick.

        Args:
            predictor: moves the joints that no tracker sees.
            watch: finds the calibration in the stream.
            calibration: from a profile; nothing is watched for then.
            rate_hz: of the ticks.
            input_delay_s: of the predictor's grid behind the ticks.
        """
        self.predictor = predictor
        self._rate_hz, self._input_delay_s = rate_hz, input_delay_s
        self.body = Body.standard()
        self.nonfinite_frames = 0
        self._bad_in_a_row = 0
        self._watch = watch
        self.presentation = Presentation()
        self._change: Change | None = None
        self.calibration: Calibration | None = None
        self._good: SkeletonPose | None = None
        if calibration is not None:
            self._begin(calibration)

    @property
    def calibrated(self) -> bool:
        """Whether the user's sizes are known."""
        return self.calibration is not None

    @property
    def roles(self) -> Mapping[str, TrackerRole]:
        """Serial -> role, as calibrated; empty before."""
        return {} if self.calibration is None else self.calibration.roles

    def calibrate(self, samples: Sequence[TrackerSample]) -> bool:
        """Look for a calibration in new samples; True when this call found the first."""
        if self.calibration is not None:
            return False
        found = self._watch(samples)
        if found is not None:
            self._begin(found)
        return found is not None

    @property
    def aim(self) -> Calibration:
        """The calibration in use, or the one that it is changing into.

        Raises:
            CalibrationError: there is none yet.
        """
        if self.calibration is None:
            raise CalibrationError("not calibrated yet: hold a T-pose.")
        return self.calibration if self._change is None else self._change.new

    def adjust(self, calibration: Calibration, now_s: float) -> None:
        """Change to other offsets, smoothly; the body stays as it is.

        Raises:
            CalibrationError: there is no calibration yet.
        """
        old = self.aim if self._change is None else self._change.at(now_s)
        self._change = Change(old, calibration, now_s)

    def shift_world(self, T_new_old: Pose) -> None:
        """The play space was set up anew: the body goes on as if nothing had been.

        Heights over the floor stay what they were, so the floor's own height moves along.
        """
        if self.calibration is None:
            return
        self.calibration = in_new_space(self.calibration, T_new_old)
        if self._change is not None:
            old, new = (in_new_space(c, T_new_old) for c in (self._change.old, self._change.new))
            self._change = Change(old, new, self._change.since_s)
        T = np.eye(4)[None]
        T[:, :3, :3], T[:, :3, 3] = T_new_old.R, T_new_old.p * LEVEL * self.calibration.scale
        self._state = self._avatar.shift_world(self._state, T)
        level = Pose(T_new_old.R, T_new_old.p * LEVEL)
        self.presentation.shift_world(level)
        self._good = None if self._good is None else in_new_world(self._good, level)

    def _changed(self, now_s: float) -> Calibration | None:
        """The calibration at a time."""
        if self._change is not None:
            self.calibration = self._change.at(now_s)
            if self._change.over(now_s):
                self._change = None
        return self.calibration

    def _begin(self, calibration: Calibration) -> None:
        self.calibration = calibration
        self.body = calibration.body
        self._avatar = Avatar(
            self.predictor,
            self.body,
            loop_rate_hz=self._rate_hz,
            input_delay_s=self._input_delay_s,
        )
        self._state = self._avatar.start()

    def step(self, tick: Tick, feed: Feed) -> SkeletonPose:
        """The body at a tick: standing still until the user is calibrated and seen."""
        return self.show(self.look(tick, feed))

    def look(self, tick: Tick, feed: Feed) -> Sight:
        """What is seen of the user at a tick, by the calibration of that time."""
        roles = feed.report(tick.time_s)
        calibration = self._changed(tick.time_s)
        if calibration is None or not feed.seen(self.predictor.card.needs):
            return Sight(tick.time_s, roles, p_head=feed.head(tick.time_s))
        frame, *grid = self._frames(calibration, tick, feed)
        return Sight(tick.time_s, roles, frame, tuple(grid))

    def show(self, sight: Sight) -> SkeletonPose:
        """The body of what was seen; each sight once, in order."""
        if sight.frame is None:
            return standing_pose(sight.time_s, sight.p_head, self.body, sight.roles)
        state, pose = self._avatar.step(self._state, sight.frame, sight.grid)
        pose = self._finite(state, replace(pose, roles=sight.roles))
        return self.presentation.show(pose, self.body)

    def _frames(self, calibration: Calibration, tick: Tick, feed: Feed) -> list[Frame]:
        """Joint poses at the tick's time, then at the grid times due by it."""
        times_s = (tick.time_s, *tick.grid_s)
        seen = feed.at(times_s)
        return [
            calibration.frame(
                time_s, feed.roles, seen.p[[i]], seen.R[[i]], seen.valid_p[[i]], seen.valid_R[[i]]
            )
            for i, time_s in enumerate(times_s)
        ]

    def _finite(self, state: State, pose: SkeletonPose) -> SkeletonPose:
        """A pose that may go out; one that is not finite leaves no trace in the state either."""
        if np.isfinite(pose.p_world).all() and np.isfinite(pose.R_local).all():
            self._state, self._good, self._bad_in_a_row = state, pose, 0
            return pose
        self.nonfinite_frames += 1
        self._bad_in_a_row += 1
        if self._bad_in_a_row >= RESTART_AFTER_S * self._rate_hz:
            self._state, self._bad_in_a_row = self._avatar.start(), 0
        if self._good is None:
            return standing_pose(pose.time_s, None, self.body, pose.roles)
        return replace(self._good, time_s=pose.time_s, roles=pose.roles)
