"""A running session obeys its user and warns them; everything is answered by a sound or a word."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from lobstr_hw.calibration.adjust import with_floor, with_heading, with_offsets_of
from lobstr_hw.drivers.driver import DeviceEvent, EventKind, TrackerDriver
from lobstr_hw.errors import CalibrationError
from lobstr_hw.rotations import Array, geodesic_angle, rotation_mean
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.calibrating import TPoseWatcher
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.gestures import Command, Gestures
from lobstr_hw.runtime.lookout import Lookout
from lobstr_hw.runtime.notices import notices
from lobstr_hw.runtime.session import Session
from lobstr_hw.runtime.ticks import Tick
from lobstr_hw.runtime.world_shift import Shift, ShiftWatch
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["Controls"]

NUDGE_M = 0.02
T_POSE_WITHIN_S = 30.0
LOOK_BACK_S = 0.25
"""A heading is the mean over so long."""

Say = Callable[[Spoken], None]
Hear = Callable[[DeviceEvent], None]


class Controls:
    """Called at every tick between the samples and the body.

    It looks at nothing but what the tick brings, so a replay obeys as the session did.
    """

    def __init__(
        self,
        driver: TrackerDriver,
        session: Session,
        feed: Feed,
        say: Say,
        hear: Hear = lambda event: None,
    ) -> None:
        """Get ready.

        Args:
            driver: open; gives events and devices.
            session: obeys.
            feed: the trackers by role.
            say: rings and speaks, at once.
            hear: is told of every event.
        """
        self._driver, self._session, self._feed, self._say = driver, session, feed, say
        self._hear = hear
        self._gestures = Gestures(feed.table.of)
        self._lookout = Lookout(driver, session, feed)
        self._was_calibrated = session.calibrated
        self._shift_watch = ShiftWatch(feed.table.of)
        self._watcher: TPoseWatcher | None = None
        self._watch_until_s = 0.0

    def __call__(self, tick: Tick, samples: Sequence[TrackerSample]) -> None:
        """One tick."""
        if self._session.calibrated and not self._was_calibrated:
            self._was_calibrated = True
            self._say(Spoken("Calibrated.", Sound.DONE))
        events = self._driver.events()
        for event in events:
            self._hear(event)
        for words in notices(events):
            self._say(Spoken(words))
        self._recentre(tick.time_s, samples, events)
        for command in self._gestures.add(tick.time_s, events):
            self._say(self._obey(command, tick.time_s))
        self._watch(tick.time_s, samples)
        for spoken in self._lookout.look(tick.time_s, samples, events):
            self._say(spoken)

    def _recentre(
        self, now_s: float, samples: Sequence[TrackerSample], events: Sequence[DeviceEvent]
    ) -> None:
        """Take the body along where the play space was set up anew."""
        recentred = any(event.kind is EventKind.RECENTRED for event in events)
        found = self._shift_watch.add(now_s, samples, recentred)
        if found is Shift.APART:
            words = "The play space was set up anew, and not all trackers moved with it. Calibrate."
            self._say(Spoken(words, Sound.TROUBLE))
        elif not isinstance(found, Shift):
            T_new_old, since_s = found
            self._feed.shift(T_new_old, since_s)
            self._session.shift_world(T_new_old)
            self._lookout.world_moved(now_s)
            if self._session.calibrated:
                self._say(Spoken("The play space was set up anew; the body moved along."))

    def _obey(self, command: Command, now_s: float) -> Spoken:
        if not self._session.calibrated:
            return Spoken("Not calibrated yet: hold a T pose.", Sound.TROUBLE)
        try:
            return _ANSWERS[command](self, now_s)
        except CalibrationError as error:
            return Spoken(str(error), Sound.TROUBLE)

    def _heading(self, now_s: float) -> Spoken:
        old = self._session.aim
        new = with_heading(old, self._rotations(now_s))
        self._session.adjust(new, now_s)
        i = list(new.roles.values()).index(TrackerRole.PELVIS)
        turn = geodesic_angle(old.R_tracker_joint[i], new.R_tracker_joint[i])
        degrees = float(np.rad2deg(turn))
        return Spoken(f"Heading corrected by {degrees:.0f} degrees.", Sound.DONE)

    def _rotations(self, now_s: float) -> dict[TrackerRole, Array]:
        """Mean rotations of the trackers in sight over the last quarter of a second."""
        times = np.linspace(now_s - LOOK_BACK_S, now_s, 6)
        seen = self._feed.at([float(time_s) for time_s in times])
        return {
            role: rotation_mean(seen.R[:, i])
            for i, role in enumerate(self._feed.roles)
            if seen.valid_R[-1, i]
        }

    def _freeze(self, now_s: float) -> Spoken:
        frozen = self._session.presentation.freeze()
        return Spoken("Frozen." if frozen else "Going on.", Sound.DONE)

    def _seat(self, now_s: float) -> Spoken:
        seated = self._session.presentation.sit()
        return Spoken("Seated." if seated else "Standing.", Sound.DONE)

    def _nudge(self, now_s: float, raise_m: float) -> Spoken:
        self._session.adjust(with_floor(self._session.aim, raise_m), now_s)
        way = "up" if raise_m > 0.0 else "down"
        return Spoken(f"{100.0 * abs(raise_m):.0f} centimetres {way}.", Sound.DONE)

    def _up(self, now_s: float) -> Spoken:
        return self._nudge(now_s, NUDGE_M)

    def _down(self, now_s: float) -> Spoken:
        return self._nudge(now_s, -NUDGE_M)

    def _t_pose(self, now_s: float) -> Spoken:
        self._watcher = TPoseWatcher(self._feed.table, self._session.aim.floor_m)
        self._watch_until_s = now_s + T_POSE_WITHIN_S
        return Spoken("Hold a T pose.")

    def _ready(self, now_s: float) -> Spoken:
        return Spoken("Get ready for a T pose.")

    def _watch(self, now_s: float, samples: Sequence[TrackerSample]) -> None:
        """For the T-pose that was asked for."""
        if self._watcher is None:
            return
        found = self._watcher(samples)
        if found is not None:
            self._session.adjust(with_offsets_of(self._session.aim, found), now_s)
            self._say(Spoken("Calibrated.", Sound.DONE))
        elif now_s >= self._watch_until_s:
            self._say(Spoken("No T pose seen; all stays as it was.", Sound.TROUBLE))
        if found is not None or now_s >= self._watch_until_s:
            self._watcher = None


_ANSWERS: Mapping[Command, Callable[[Controls, float], Spoken]] = {
    Command.HEADING: Controls._heading,
    Command.FREEZE: Controls._freeze,
    Command.SEAT: Controls._seat,
    Command.UP: Controls._up,
    Command.DOWN: Controls._down,
    Command.T_POSE: Controls._t_pose,
    Command.READY: Controls._ready,
}
