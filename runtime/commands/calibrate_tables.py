"""What ``lobstr-calibrate`` shows: the measures, the trackers, and what to make of them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich.table import Table

from lobstr_hw.calibration import Calibration, TPose, TrackingSpace
from lobstr_hw.calibration.movement import Refinement
from lobstr_hw.calibration.verdict import Grade, findings, verdict
from lobstr_hw.rotations import Array

__all__ = ["closing_words", "movement_table", "spaces_table", "tables"]

_STYLES = {Grade.GOOD: "green", Grade.FAIR: "yellow", Grade.POOR: "red"}
_WORDS = {
    Grade.GOOD: "A good T-pose.",
    Grade.FAIR: "A usable T-pose; a better one is worth the ten seconds.",
    Grade.POOR: "Something is odd: do the T-pose again.",
}


def tables(pose: TPose, calibration: Calibration) -> tuple[Table, Table, Table]:
    """Measures, trackers, findings."""
    return _measures(pose, calibration), _trackers(calibration), _findings(calibration)


def closing_words(calibration: Calibration, path: Path) -> list[str]:
    """The verdict, and where the profile is."""
    return [_WORDS[verdict(calibration.residuals)], f"Profile: {path}"]


def _measures(pose: TPose, calibration: Calibration) -> Table:
    residuals = calibration.residuals
    table = Table(title="You", show_header=False)
    rows = (
        ("T-pose", f"{pose.start_s:.1f} to {pose.end_s:.1f} s"),
        ("facing", f"{np.rad2deg(calibration.heading_rad):.0f} degrees"),
        ("height", f"{100.0 * calibration.stature_m:.0f} cm"),
        ("hips", _with_deviation(1.0 / calibration.scale, residuals.hips_height_deviation_m)),
        ("arms", _with_deviation(calibration.arm_m, residuals.arm_deviation_m)),
        ("floor", f"{100.0 * calibration.floor_m:.1f} cm"),
    )
    for row in rows:
        table.add_row(*row)
    return table


def _with_deviation(value_m: float, deviation_m: float) -> str:
    return f"{100.0 * value_m:.1f} cm, give or take {100.0 * deviation_m:.1f}"


def _trackers(calibration: Calibration) -> Table:
    table = Table("tracker", "stands for", "sits off its joint by", title="Trackers")
    for i, (serial, role) in enumerate(calibration.roles.items()):
        # in the joint's own frame, which a person can imagine: left, up, forward of the joint
        lever = -(calibration.R_tracker_joint[i].T @ calibration.p_tracker_joint[i])
        table.add_row(serial, role.replace("_", " "), _direction(100.0 * lever))
    return table


def _direction(off_cm: Array) -> str:
    words = (("left", "right"), ("up", "down"), ("forward", "back"))
    parts = [
        f"{abs(value):.0f} {pair[0 if value > 0 else 1]}"
        for value, pair in zip(off_cm, words, strict=True)
        if abs(value) >= 0.5
    ]
    return ", ".join(parts) + " cm" if parts else "nothing"


def movement_table(refinement: Refinement) -> Table:
    """How well each is known before and after the movement."""
    table = Table("what", "T-pose", "and movement", "to know it better", title="Give or take")
    for q in refinement.quantities:
        better = "" if q.refined else q.missing
        table.add_row(q.name, f"{q.before:.1f} {q.unit}", f"{q.after:.1f} {q.unit}", better)
    return table


def spaces_table(spaces: Mapping[str, TrackingSpace]) -> Table:
    """How well the parts of the body fit together that different systems track."""
    table = Table("tracking space", "joined to within", "its stamps", title="Tracking spaces")
    for i, (name, space) in enumerate(spaces.items()):
        within = f"{1e3 * space.residual_m:.1f} mm, {np.rad2deg(space.residual_rad):.1f} degrees"
        late = f"{1e3 * space.delay_s:.0f} ms late"
        table.add_row(name, *((within, late) if i else ("the world", "")))
    return table


def _findings(calibration: Calibration) -> Table:
    table = Table("check", "value", "verdict", "what to do", title="How well")
    for finding in findings(calibration.residuals):
        grade = f"[{_STYLES[finding.grade]}]{finding.grade}[/]"
        table.add_row(finding.name, finding.value, grade, finding.advice)
    return table
