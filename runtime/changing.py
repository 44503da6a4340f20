"""From one calibration to another while somebody is moving."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.adjust import between
from lobstr_hw.calibration.calibration import Calibration
from lobstr_hw.ik.vectors import smoothstep

__all__ = ["CHANGE_S", "Change"]

CHANGE_S = 0.5
"""A jump would be a blow to the network, and to whoever looks on."""


@dataclass(frozen=True, slots=True)
class Change:
    """Smoothly from the old to the new, beginning at a time."""

    old: Calibration
    new: Calibration
    since_s: float

    def at(self, now_s: float) -> Calibration:
        """On the way."""
        share = float(smoothstep(np.array(now_s - self.since_s), 0.0, CHANGE_S))
        return between(self.old, self.new, share)

    def over(self, now_s: float) -> bool:
        """Whether the new one has been reached."""
        return now_s - self.since_s >= CHANGE_S
