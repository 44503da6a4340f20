"""A recording's body anew, its legs by the network that knows what comes next.

First the log is played through the live program as far as the joint poses: the same feed, gate,
calibration and gestures, tick by tick. Then the legs are worked out over all of it, and the avatar
(contact lock, IK, what is shown frozen or seated) goes through the same ticks once more.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.errors import LogFileError
from lobstr_hw.poses import Pose
from lobstr_hw.predictors import load_predictor
from lobstr_hw.predictors.lobstr import Lobstr
from lobstr_hw.predictors.predictor import Frame
from lobstr_hw.predictors.refined import SHORTEST_S, refined
from lobstr_hw.predictors.two_way import TwoWay, load_two_way
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.loop import take_in
from lobstr_hw.runtime.presenting import Presentation
from lobstr_hw.runtime.session import Session, Sight
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose

__all__ = ["Recording", "refined_poses", "seen_in"]

Tell = Callable[[str], None]
Step = Callable[[float, float], None]


class Request(Enum):
    """What a user may ask to be shown."""

    FREEZE = "freeze"
    SIT = "sit"


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """A tick of a recording: what was seen, and what happened just before.

    Attributes:
        sight: of the tick.
        asked: what the user asked for.
        T_new_old: the play space was set up anew; heights over the floor left alone.
    """

    sight: Sight
    asked: tuple[Request, ...] = ()
    T_new_old: Pose | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Everything the live program would have seen of a log.

    Attributes:
        moments: one per tick.
        session: at the end of the log; calibrated.
        options: rate and delay it was played with.
        damage: why the log ends early, or empty.
    """

    moments: tuple[Moment, ...]
    session: Session
    options: LiveOptions
    damage: str = ""

    @property
    def body(self) -> Body:
        """The user's sizes."""
        return self.session.body


class Requests(Presentation):
    """Notes what the user asks for instead of showing it.

    Attributes:
        noted: since it was last emptied.
        shifted: the world, since it was last emptied.
    """

    def __init__(self) -> None:
        """Nothing yet."""
        super().__init__()
        self.noted: list[Request] = []
        self.shifted: Pose | None = None

    def freeze(self) -> bool:
        """Note it; the answer is spoken as it was live."""
        self.noted.append(Request.FREEZE)
        self.frozen = not self.frozen
        return self.frozen

    def shift_world(self, T_new_old: Pose) -> None:
        """Note it; nothing that is shown is kept here."""
        self.shifted = T_new_old

    def sit(self) -> bool:
        """Note it."""
        self.noted.append(Request.SIT)
        self.seated = not self.seated
        return self.seated

    def take(self) -> tuple[tuple[Request, ...], Pose | None]:
        """What was noted, which is forgotten."""
        noted, self.noted = tuple(self.noted), []
        shifted, self.shifted = self.shifted, None
        return noted, shifted


def seen_in(path: Path, profile: Path | None, tell: Tell, step: Step) -> Recording:
    """Play a log as the live program does, up to the joint poses.

    Args:
        path: of the log.
        profile: calibration; None takes the one in the log, or its T-pose.
        tell: is given what the live program would say.
        step: is told of the seconds done, and of how many there are.

    Raises:
        LobstrError: the log cannot be read, is of nobody, or holds no calibration.
    """
    options = LiveOptions(profile=profile, fast=True, quiet=True)
    moments: list[Moment] = []
    driver = ReplayDriver(path)
    with LiveSession(driver, options, tell) as live:
        requests = live.session.presentation = Requests()
        for tick in live.ticks:
            take_in(tick, live.source, live.feed, live.session, control=live.controls)
            sight = live.session.look(tick, live.feed)
            moments.append(Moment(sight, *requests.take()))
            if tick.index % 90 == 0:
                step(tick.time_s, driver.duration_s)
        if not live.session.calibrated:
            raise live.watcher.failure()
        return Recording(tuple(moments), live.session, options, driver.log.damage)


def refined_poses(
    recording: Recording, live: Lobstr | None = None, two_way: TwoWay | None = None
) -> Iterator[SkeletonPose]:
    """The body at each tick; the networks have run when this returns.

    Args:
        recording: of :func:`seen_in`.
        live: the network that was, or would have been, shown live; the shipped one if None.
        two_way: the shipped one if None.

    Raises:
        LogFileError: there is too little of the user.
    """
    session = _second_session(recording, live or _shipped_live(), two_way or load_two_way())
    return (_show(session, moment) for moment in recording.moments)


def _show(session: Session, moment: Moment) -> SkeletonPose:
    if moment.T_new_old is not None:
        session.shift_world(moment.T_new_old)
    for request in moment.asked:
        if request is Request.FREEZE:
            session.presentation.freeze()
        else:
            session.presentation.sit()
    return session.show(moment.sight)


def _second_session(recording: Recording, live: Lobstr, two_way: TwoWay) -> Session:
    frames = _in_one_world(recording)
    rate_hz = live.card.rate_hz
    if len(frames) < SHORTEST_S * rate_hz:
        raise LogFileError(
            f"the user is in sight for {len(frames) / rate_hz:.1f} s after the calibration; "
            f"to be refined a recording needs {SHORTEST_S:g} s. Export it without --refine."
        )
    first = recording.session
    options = recording.options
    return Session(
        refined(frames, live, two_way),
        lambda samples: None,
        replace(first.aim, body=first.body),
        rate_hz=options.rate_hz,
        input_delay_s=options.input_delay_s,
    )


def _in_one_world(recording: Recording) -> list[Frame]:
    """The grid's frames, all in the world of the last: nobody leaps where the space was moved."""
    scale = float(recording.body.scale[0])
    frames: list[Frame] = []
    T_last = Pose.identity()
    for moment in reversed(recording.moments):
        frames += [_moved(frame, T_last) for frame in reversed(moment.sight.grid)]
        if (T := moment.T_new_old) is not None:
            T_last = T_last @ Pose(T.R, scale * T.p)
    return frames[::-1]


def _moved(frame: Frame, T: Pose) -> Frame:
    return replace(frame, p=T.apply(frame.p), R=T.R @ frame.R)


def _shipped_live() -> Lobstr:
    predictor = load_predictor("lobstr")
    if not isinstance(predictor, Lobstr):
        raise AssertionError("the shipped predictor is a network")
    return predictor
