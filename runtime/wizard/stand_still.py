"""Standing still for a second: everybody is ready, and nobody is hurried into the T-pose."""

from collections.abc import Sequence

import numpy as np

from lobstr_hw.calibration.stillness import Window
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.wizard.stage import Person, Stage
from lobstr_hw.runtime.wizard.view import Bar
from lobstr_hw.trackers import FOUR_POINTS, TrackerSample

__all__ = ["StandStill"]

HOLD_S = 1.0
STILL_M, STEADY_RAD = 0.03, np.deg2rad(8.0)


class StandStill(Stage):
    """Done once all four trackers have been still for a second, or on a trigger press."""

    title = "Stand still"
    instruction = "Stand upright and still, feet under your hips; look straight ahead."
    restarts = True
    spoken = "Stand still and look straight ahead."

    def __init__(self, person: Person) -> None:
        """Begin with nothing seen."""
        super().__init__(person)
        self._window = Window(HOLD_S)
        self._spread: tuple[float, float] | None = None

    def add(self, now_s: float, samples: Sequence[TrackerSample], pressed: str | None) -> bool:
        """Look for a still second."""
        self._window.add(samples)
        roles = self.person.table.roles
        seen = [serial for serial in self._window.serials if roles.get(serial) in FOUR_POINTS]
        rests = [rest for serial in seen if (rest := self._window.rest(serial)) is not None]
        if len(rests) < len(FOUR_POINTS):
            self._spread = None
        else:
            self._spread = max(r.spread_m for r in rests), max(r.spread_rad for r in rests)
        return pressed is not None or (self._spread is not None and self._still())

    def _still(self) -> bool:
        assert self._spread is not None
        return self._spread[0] <= STILL_M and self._spread[1] <= STEADY_RAD

    def bars(self) -> tuple[Bar, ...]:
        """How still."""
        if self._spread is None:
            return (Bar("stillness", 0.0, False, ""),)
        off = max(self._spread[0] / STILL_M, self._spread[1] / STEADY_RAD)
        share = max(0.0, 1.0 - 0.5 * off)
        return (Bar("stillness", share, self._still(), f"{100.0 * self._spread[0]:.1f} cm"),)

    def failure(self) -> CalibrationError:
        """Never still."""
        return CalibrationError("nobody stood still for a second. Stand still and try again.")
