"""Optional step: the height of the floor, touched with a controller."""

from collections.abc import Sequence

import numpy as np

from lobstr_hw.calibration.stillness import Window
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.runtime.wizard.view import Bar
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["CLEARANCE_M", "TouchFloor"]

CLEARANCE_M = 0.03
"""From the floor to a controller's own origin when it lies there: half the thickness of a handle.
Devices differ by a centimetre or two; ``--floor CM`` says it better."""
STILL_S, STILL_M = 0.7, 0.01
BENT_M = 0.25
"""Nobody reaches the floor without lowering the head so far."""
UNDER_BELT_M = 0.30
"""So far under the belt a hand only comes by reaching down."""
HANDS = (TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND)


class TouchFloor(Stage):
    """Done when a controller lies still far below belt and head, or on a trigger press there."""

    title = "Floor"
    instruction = "Touch the floor with one controller and hold it there for a second."
    spoken = "Touch the floor with a controller."

    def __init__(self, person: Person, clearance_m: float = CLEARANCE_M) -> None:
        """Begin.

        Args:
            person: what is known so far.
            clearance_m: from the floor to the origin of a controller that touches it.
        """
        super().__init__(person)
        self._clearance_m = clearance_m
        self._window = Window(STILL_S)
        self._highest_m = -np.inf
        self._advice = ""
        self._reach = (0.0, "")

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Look for a controller on the floor."""
        self._window.add(samples)
        heights = self._heights()
        head = heights.get(TrackerRole.HEAD)
        if head is None or not any(hand in heights for hand in HANDS):
            return False
        self._highest_m = max(self._highest_m, head[0])
        hand = min((h for h in HANDS if h in heights), key=lambda h: heights[h][0])
        y, spread_m = heights[hand]
        belt = heights.get(TrackerRole.PELVIS, head)[0]
        under_m = belt - y
        self._reach = (min(1.0, under_m / (2.0 * UNDER_BELT_M)), f"{100.0 * under_m:.0f} cm")
        touching = under_m >= UNDER_BELT_M
        if pressed is not None and not touching:
            self._advice = "hold the controller on the floor, then press its trigger"
        bent = self._highest_m - head[0] >= BENT_M
        if touching and ((bent and spread_m <= STILL_M) or pressed is not None):
            self.person.floor_m = y - self._clearance_m
            return True
        return False

    def _heights(self) -> dict[TrackerRole, tuple[float, float]]:
        """Height and unrest of each role's tracker."""
        out = {}
        for serial in self._window.serials:
            role = self.person.table.roles.get(serial)
            rest = self._window.rest(serial) if role is not None else None
            if role is not None and rest is not None:
                out[role] = (float(rest.p[1]), rest.spread_m)
        return out

    def bars(self) -> tuple[Bar, ...]:
        """How far a hand is below the belt."""
        share, words = self._reach
        return (Bar("below belt", max(0.0, share), share >= 0.5, words),)

    def advice(self) -> str:
        """After a press in the air."""
        return self._advice

    def done_words(self) -> Spoken | None:
        """The height, so that a wrong one is noticed."""
        off_cm = 100.0 * self.person.floor_m
        where = "above" if off_cm > 0.0 else "below"
        return Spoken(f"Floor found, {abs(off_cm):.0f} centimetres {where} zero.", Sound.DONE)

    def failure(self) -> CalibrationError:
        """No controller came down."""
        return CalibrationError(
            "no controller touched the floor. Lay one on the floor for a second, or leave --floor "
            "out to take the floor of the tracking space."
        )
