"""What came of it: as a JSON document, as tables, and as a sentence for the ear."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from lobstr_hw.calibration.movement import Refinement
from lobstr_hw.calibration.verdict import Grade, findings, verdict
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.commands.calibrate_tables import (
    closing_words,
    movement_table,
    spaces_table,
    tables,
)
from lobstr_hw.runtime.wizard.stage import Person

__all__ = ["document", "show", "spoken_result"]

_WORDS = {
    Grade.GOOD: "Calibration is good.",
    Grade.FAIR: "Calibration is usable.",
    Grade.POOR: "Something is odd, better do it again.",
}


def document(person: Person, path: Path) -> dict[str, Any]:
    """The result, units in the keys."""
    pose, calibration = person.t_pose, person.calibration
    assert pose is not None and calibration is not None
    return {
        "profile": str(path),
        "verdict": str(verdict(calibration.residuals)),
        "t_pose_s": [pose.start_s, pose.end_s],
        "stature_m": calibration.stature_m,
        "hips_height_m": 1.0 / calibration.scale,
        "scale": calibration.scale,
        "arm_m": calibration.arm_m,
        "heading_rad": calibration.heading_rad,
        "floor_height_m": calibration.floor_m,
        "trackers": {serial: str(role) for serial, role in calibration.roles.items()},
        "residuals": asdict(calibration.residuals),
        "tracking_spaces": {
            name: {
                "residual_m": space.residual_m,
                "residual_rad": space.residual_rad,
                "delay_s": space.delay_s,
            }
            for name, space in person.spaces.items()
        },
        "movement": None if person.refinement is None else _movement(person.refinement),
    }


def _movement(refinement: Refinement) -> dict[str, Any]:
    """What is known how well before and after the movement (deviations)."""
    quantities = {
        q.name: {"unit": q.unit, "before": q.before, "after": q.after, "missing": q.missing}
        for q in refinement.quantities
    }
    return {"quantities": quantities, "missing": list(refinement.missing)}


def show(person: Person, path: Path) -> None:
    """Tables and closing words on stdout."""
    pose, calibration = person.t_pose, person.calibration
    assert pose is not None and calibration is not None
    console = Console()
    for table in tables(pose, calibration):
        console.print(table)
    if person.refinement is not None:
        console.print(movement_table(person.refinement))
    if len(person.spaces) > 1:
        console.print(spaces_table(person.spaces))
    for line in closing_words(calibration, path):
        console.print(line, soft_wrap=True, highlight=False, markup=False)


def spoken_result(person: Person) -> Spoken:
    """The verdict, the height (everybody knows their own), and what to do better."""
    calibration = person.calibration
    assert calibration is not None
    grade = verdict(calibration.residuals)
    height = f"You are {100.0 * calibration.stature_m:.0f} centimetres tall."
    advice = [f.advice for f in findings(calibration.residuals) if f.grade is grade and f.advice]
    words = " ".join([_WORDS[grade], height, *advice[:1]])
    return Spoken(words, Sound.TROUBLE if grade is Grade.POOR else Sound.DONE)
