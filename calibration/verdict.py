"""A calibration in words: what to make of its numbers, and what to do about them."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from lobstr_hw.calibration.calibration import Residuals

__all__ = ["Finding", "Grade", "findings", "verdict"]


class Grade(StrEnum):
    """How good it is."""

    GOOD = "good"
    FAIR = "fair"
    POOR = "poor"


@dataclass(frozen=True, slots=True)
class Finding:
    """One number with its meaning.

    Attributes:
        name: of the number.
        value: with its unit.
        grade: of it.
        advice: what would make it better; empty where it is good.
    """

    name: str
    value: str
    grade: Grade
    advice: str


def findings(residuals: Residuals) -> tuple[Finding, ...]:
    """Every residual, graded.

    Of simulated users, each as sloppy as people are, 95 in 100 stay within the first limit of each
    row and all within the second.
    """
    heading_deg = abs(float(np.rad2deg(residuals.heading_disagreement_rad)))
    spread_deg = float(np.rad2deg(residuals.spread_rad))
    rows = (
        ("held still", 100.0 * residuals.spread_m, "cm", (2.5, 3.5), "Hold hands and head still."),
        ("held steady", spread_deg, "degrees", (2.5, 4.5), "Hold hands and head still."),
        (
            "headset against hands",
            heading_deg,
            "degrees",
            (10.0, 20.0),
            "Look straight ahead, arms neither forward nor back.",
        ),
        (
            "fits a person",
            residuals.misfit,
            "deviations",
            (1.3, 1.8),
            "Stand straight, arms level; is the floor of the tracking space at height 0?",
        ),
    )
    return tuple(_graded(*row) for row in rows)


def _graded(
    name: str, value: float, unit: str, limits: tuple[float, float], advice: str
) -> Finding:
    grade = Grade.GOOD if value <= limits[0] else Grade.FAIR if value <= limits[1] else Grade.POOR
    return Finding(name, f"{value:.1f} {unit}", grade, "" if grade is Grade.GOOD else advice)


def verdict(residuals: Residuals) -> Grade:
    """The worst of all findings."""
    grades = [finding.grade for finding in findings(residuals)]
    return max(grades, key=list(Grade).index)
