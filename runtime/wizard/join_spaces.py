"""Two tracking systems as one world: a tracker of each, held together and turned about."""

from collections import deque
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from lobstr_hw.calibration.alike import ALIKE, common_s, most_alike
from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.calibration.hand_eye import wobble
from lobstr_hw.calibration.spaces import (
    LEAST_S,
    LEAST_WOBBLE_RAD,
    TOGETHER,
    SpaceAlignment,
    align_spaces,
)
from lobstr_hw.calibration.track import Track
from lobstr_hw.calibration.verdict import Grade
from lobstr_hw.errors import CalibrationError, SpacesNotJoined
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.one_space import OneSpace
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.runtime.wizard.view import Bar
from lobstr_hw.trackers import TrackerSample

__all__ = ["JoinSpaces"]

WINDOW_S = 8.0
"""Looked at; what was before, while the trackers were taken in hand, is forgotten."""
ENOUGH_S = 7.5
LOOK_EVERY_S = 1.0
SETTLE_S = 6.0
"""After so long a usable alignment is taken: a better one does not seem to come."""
SHOWN_S = 2.0
"""So long the verdict stands on the screen, before the next step's words."""


class JoinSpaces(Stage):
    """Done when two trackers moved as one, or on a press where it was told before.

    Whoever does it wrong need not begin again: only the newest seconds count.
    """

    title = "Join"
    counted = False
    repeats_s = 20.0

    def __init__(
        self, person: Person, world: OneSpace, name: str, known: TrackingSpace | None = None
    ) -> None:
        """Begin.

        Args:
            person: is asked for nothing here.
            world: the driver, whose space of this name is not joined yet.
            name: of that space.
            known: as it was found before; a press keeps it.
        """
        super().__init__(person)
        self._world, self._name, self._known = world, name, known
        self._kept: dict[str, deque[TrackerSample]] = {}
        self._next_s = -np.inf
        self._seconds, self._turned_rad = 0.0, 0.0
        self._latest: SpaceAlignment | None = None
        self._usable_since_s = np.inf
        self._now_s = 0.0
        self._done_s = np.inf
        self._trouble = ""
        others = " or ".join(world.spaces)
        self.instruction = (
            f"Hold a tracker of {name} and one of {others} firmly together. Turn both about all "
            "axes for ten seconds: like a steering wheel, a key, a nod."
        )
        self.spoken = (
            f"Hold the {name} tracker and one of {others} firmly together, and turn them about "
            "all axes."
        )
        if known is not None:
            self.instruction += " Nothing has changed since last time? Press a trigger or Enter."

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Look at the newest seconds."""
        self._now_s = now_s
        if self._name in self._world.spaces:
            return now_s >= self._done_s
        self._keep(samples)
        if pressed is not None and self._known is not None:
            self._latest = None
            self._world.join(self._name, self._known)
            self._tell("Joined as last time.")
        elif now_s >= self._next_s:
            self._next_s = now_s + LOOK_EVERY_S
            self._look()
            if self._latest is not None and self._enough():
                self._join(self._latest)
        return False

    def _keep(self, samples: Iterable[TrackerSample]) -> None:
        for sample in samples:
            kept = self._kept.setdefault(sample.serial, deque())
            kept.append(sample)
            while kept[0].time_s < sample.time_s - WINDOW_S:
                kept.popleft()

    def _look(self) -> None:
        """Choose the pair that turns most alike, and fit it."""
        self._latest, self._trouble = None, ""
        of_a, of_b = self._tracks(list(self._world.spaces)), self._tracks((self._name,))
        if not (of_a and of_b):
            lost = self._name if of_a else " or ".join(self._world.spaces)
            self._seconds, self._turned_rad = 0.0, 0.0
            self._trouble = f"no tracker of {lost} in sight"
            return
        self._seconds = max(common_s(a, b) for a in of_a.values() for b in of_b.values())
        most = [max(wobble(track.R) for track in of.values()) for of in (of_a, of_b)]
        self._turned_rad = min(most)
        pair = most_alike(of_a, of_b, LEAST_S, LEAST_WOBBLE_RAD)
        if pair is None:
            if self._seconds >= ENOUGH_S:
                self._trouble = "turn both about all axes: like a steering wheel, a key, a nod"
            return
        a, b, likeness = pair
        try:
            self._latest = align_spaces(self._kept[a], self._kept[b]) if likeness > ALIKE else None
        except SpacesNotJoined:
            pass
        if self._latest is None:
            self._usable_since_s = np.inf
            self._trouble = "they do not move as one: hold them firmly together and go on turning"

    def _tracks(self, names: Collection[str | None]) -> dict[str, Track]:
        """Serial -> track of the trackers in these spaces, as far as they are in sight."""
        tracks = {
            serial: Track.of(kept)
            for serial, kept in self._kept.items()
            if self._world.space_of(serial) in names
        }
        begin_s = self._now_s - LEAST_S
        return {s: t for s, t in tracks.items() if len(t) > 1 and t.times_s[-1] >= begin_s}

    def _enough(self) -> bool:
        """Good for the whole window, or usable for so long that better will not come."""
        assert self._latest is not None
        if self._seconds < ENOUGH_S:
            return False
        if self._latest.grade is Grade.GOOD:
            return True
        self._usable_since_s = min(self._usable_since_s, self._now_s)
        return self._now_s - self._usable_since_s >= SETTLE_S

    def _join(self, found: SpaceAlignment) -> None:
        # measured against stamps that were moved by those of the spaces before
        delay_s = found.delay_s + self._world.earliest_s
        self._world.join(self._name, replace(found.space(), delay_s=delay_s))
        self._tell(f"Joined to within {_within(found)}: {_VERDICTS[found.grade]}")

    def _tell(self, words: str) -> None:
        """Nothing more is to be done here."""
        self.instruction = self.spoken = words
        self._trouble = ""
        self._done_s = self._now_s + SHOWN_S

    def end(self) -> bool:
        """A log that ends here has what it has."""
        if self._latest is not None and self._name not in self._world.spaces:
            self._join(self._latest)
        return self._name in self._world.spaces

    def bars(self) -> tuple[Bar, ...]:
        """In sight for long enough, turned enough, moving as one."""
        degrees = np.rad2deg(self._turned_rad)
        turned = Bar(
            "turned",
            min(1.0, 0.5 * self._turned_rad / LEAST_WOBBLE_RAD),
            bool(self._turned_rad >= LEAST_WOBBLE_RAD),
            f"{degrees:.0f} degrees out of one axis",
        )
        if self._latest is None:
            return turned, Bar("as one", 0.0, False, "")
        off = max(
            self._latest.residual_m / TOGETHER[0][0], self._latest.residual_rad / TOGETHER[0][1]
        )
        share = max(0.0, 1.0 - 0.5 * off)
        return turned, Bar("as one", share, self._latest.grade is Grade.GOOD, _within(self._latest))

    def advice(self) -> str:
        """What is wrong just now."""
        return self._trouble

    def progress(self) -> float | None:
        """Of the seconds that are needed."""
        return min(1.0, self._seconds / ENOUGH_S)

    def done_words(self) -> Spoken | None:
        """From here on it does not matter any more what tracks what."""
        return Spoken("Now you are in one world.", Sound.DONE)

    def failure(self) -> CalibrationError:
        """Why they are not joined."""
        others = " and ".join(self._world.spaces)
        why = self._trouble or "they were not turned together for long enough"
        return SpacesNotJoined(
            f"the tracking spaces of {others} and {self._name} are not joined: {why}. Hold one "
            "tracker of each firmly together, in sight of both systems, and turn them about all "
            "axes for ten seconds."
        )


_VERDICTS = {
    Grade.GOOD: "good.",
    Grade.FAIR: "usable. Held together more firmly it would be better.",
}


def _within(found: SpaceAlignment) -> str:
    """The residuals, none of them called nothing."""
    mm = max(1, round(1e3 * found.residual_m))
    degrees = max(0.1, float(np.rad2deg(found.residual_rad)))
    return f"{mm} millimetre{'s' if mm > 1 else ''} and {degrees:.1f} degrees"
