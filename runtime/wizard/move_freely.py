"""A few seconds of movement: what one pose cannot tell (docs/calibration.md)."""

from collections.abc import Sequence
from dataclasses import dataclass

from lobstr_hw.calibration.movement import refine_by_movement
from lobstr_hw.calibration.recording import movement_from_samples
from lobstr_hw.calibration.self_check import check_calibration
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.trackers import TrackerSample

__all__ = ["PARTS", "MoveFreely", "Part", "WatchMovement"]


@dataclass(frozen=True, slots=True)
class Part:
    """One thing to do.

    Attributes:
        instruction: for the eye.
        spoken: for the ear.
        seconds: to hear it and to do it.
    """

    instruction: str
    spoken: str
    seconds: float


PARTS = (
    Part("Lower your arms, stand easy.", "Lower your arms.", 2.0),
    Part("Nod a few times, then shake your head; the rest stands still.", "Nod. Shake.", 3.5),
    Part("Hold your arms still; twist and bend both wrists.", "Twist and bend your wrists.", 3.5),
    Part("Bow once, legs straight.", "Bow.", 2.5),
    Part("Walk a few steps straight ahead, and stop.", "Walk a few steps.", 3.0),
    Part("Turn round on the spot.", "Turn around.", 3.5),
)
LOG_S = sum(part.seconds for part in PARTS) + 4.0
"""So much of a log after its T-pose is looked at."""
AGAIN_S = 4.5
MOST_AGAIN = 2
"""More than two things to do again would be a second wizard, and the whole take over 30 s."""


class MoveFreely(Stage):
    """Asks for one part after the other; a trigger press goes on to the next.

    What was not seen is asked for once more. Whatever is still missing then only leaves some
    numbers as uncertain as the T-pose had them.
    """

    title = "Movement"
    repeats_s = float("inf")

    def __init__(self, person: Person, parts: Sequence[Part] = PARTS) -> None:
        """Begin.

        Args:
            person: with a T-pose.
            parts: what to ask for.
        """
        super().__init__(person)
        self._parts = list(parts)
        self._asked_again = False
        self._since_s: float | None = None
        self._now_s = 0.0
        self._ask(0)

    def _ask(self, index: int) -> None:
        self._index = index
        self._since_s = None
        self.instruction = self._parts[index].instruction
        self.spoken = self._parts[index].spoken

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Collect; done after the last part."""
        self.person.movement.extend(samples)
        self._now_s = now_s
        if self._since_s is None:
            self._since_s = now_s
        if pressed is None and now_s - self._since_s < self._parts[self._index].seconds:
            return False
        if self._index + 1 == len(self._parts):
            refine(self.person)
            self._parts += self._once_more()
        if self._index + 1 == len(self._parts):
            return True
        self._ask(self._index + 1)
        return False

    def _once_more(self) -> list[Part]:
        refinement = self.person.refinement
        if self._asked_again or refinement is None:
            return []
        self._asked_again = True
        if not refinement.missing:
            return []
        words = ", and ".join(refinement.missing[:MOST_AGAIN])
        words = words[0].upper() + words[1:] + "."
        return [Part(f"Once more: {words}", words, AGAIN_S)]

    def progress(self) -> float | None:
        """Of the part."""
        if self._since_s is None:
            return 0.0
        return min(1.0, (self._now_s - self._since_s) / self._parts[self._index].seconds)


class WatchMovement(Stage):
    """The same for a log: whatever happens after the T-pose is looked at for a while."""

    title = "Movement"
    instruction = "Looking at the movement after the T-pose."

    def __init__(self, person: Person) -> None:
        """Begin."""
        super().__init__(person)
        self._until_s: float | None = None

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Collect."""
        self.person.movement.extend(samples)
        if self._until_s is None:
            self._until_s = now_s + LOG_S
        if now_s < self._until_s:
            return False
        refine(self.person)
        return True

    def end(self) -> bool:
        """A log need not be so long; its T-pose stands in any case."""
        refine(self.person)
        return True


def refine(person: Person) -> None:
    """Calibrate from the T-pose and all movement since, and look whether it can be right."""
    assert person.t_pose is not None
    pose = person.t_pose
    recording = movement_from_samples(person.movement, pose.serials)
    person.refinement = refine_by_movement(
        pose,
        recording.between(pose.end_s),
        stature_m=person.stature_m,
        floor_m=person.floor_m,
        created=person.created,
    )
    person.calibration = person.refinement.calibration
    person.check = check_calibration(pose, recording, person.refinement)
