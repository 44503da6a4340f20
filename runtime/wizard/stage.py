"""What every step of the wizard is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lobstr_hw.calibration import Calibration, TPose, TrackingSpace
from lobstr_hw.calibration.movement import Refinement
from lobstr_hw.calibration.self_check import SelfCheck
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.announcer import Spoken
from lobstr_hw.runtime.wizard.device_table import DeviceTable
from lobstr_hw.runtime.wizard.view import Bar
from lobstr_hw.trackers import TrackerSample

__all__ = ["Person", "Stage"]


@dataclass(slots=True, eq=False)
class Person:
    """What is known so far; each step adds to it.

    Attributes:
        table: devices and roles.
        stature_m: as typed in; None if not.
        created: when this is, for the profile.
        spaces: tracking spaces that the trackers are in, by name, for the profile.
        floor_m: of the tracking space.
        t_pose: once it is found.
        calibration: once it is made.
        movement: samples of the T-pose and since.
        refinement: what the movement told; None before it was looked at.
        check: what the self-check found; None before it was made.
    """

    table: DeviceTable = field(default_factory=DeviceTable)
    stature_m: float | None = None
    created: str = ""
    spaces: Mapping[str, TrackingSpace] = field(default_factory=dict)
    floor_m: float = 0.0
    t_pose: TPose | None = None
    calibration: Calibration | None = None
    movement: list[TrackerSample] = field(default_factory=list)
    refinement: Refinement | None = None
    check: SelfCheck | None = None

    def once_more(self) -> None:
        """Forget the T-pose and what came of it."""
        self.t_pose = self.calibration = self.refinement = self.check = None
        self.movement = []


class Stage:
    """A step: it looks at samples until it is done. All time comes with them.

    Attributes:
        title: two or three words.
        instruction: what the person should do, for the eye.
        spoken: the same for the ear, short; also said again when nothing happens.
        counted: whether a countdown may stand before it.
        restarts: where to go on when a calibration turns out wrong; the last such stage counts.
        repeats_s: how often ``spoken`` is said again.
    """

    title = ""
    instruction = ""
    spoken = ""
    counted = True
    restarts = False
    repeats_s = 15.0

    def __init__(self, person: Person) -> None:
        """Begin; whatever came before is in ``person``."""
        self.person = person

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Look at new samples; True once the step is done.

        Args:
            now_s: the time of this turn.
            samples: oldest first.
            pressed: serial of the controller whose trigger was pressed, "" for the keyboard or
                another program, None if nothing was.
        """
        raise NotImplementedError

    def end(self) -> bool:
        """Nothing more comes; True when the step can be done with what it has."""
        return False

    def bars(self) -> tuple[Bar, ...]:
        """Qualities of this moment."""
        return ()

    def advice(self) -> str:
        """What is wrong just now; empty if nothing."""
        return ""

    def progress(self) -> float | None:
        """How far it is, 0 to 1; None where that is not known."""
        return None

    def done_words(self) -> Spoken | None:
        """What to say when it is done."""
        return None

    def failure(self) -> CalibrationError:
        """Why it could not be done, when nothing more comes."""
        return CalibrationError(f"the step '{self.title}' was not finished. Try again.")

    def shows_devices(self) -> bool:
        """Whether the table of devices belongs on the screen."""
        return False
