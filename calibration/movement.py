"""A T-pose and a few seconds of movement -> a calibration (design.md 4).

One pose cannot tell a tilted tracker from a tilted limb. Movement can: what is up while somebody
stands and walks, where they walk to, about which axes head and hands turn, which points rest
meanwhile. Each of these narrows what the T-pose gave; what the movement did not show stays as it
was.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.calibration import Calibration, Residuals
from lobstr_hw.calibration.evidence import directions
from lobstr_hw.calibration.heading import hands_heading
from lobstr_hw.calibration.levers import head_place, levers_from_movement
from lobstr_hw.calibration.measures import LeverPrior, Measures, fit_measures
from lobstr_hw.calibration.orientation import (
    Direction,
    Orientations,
    Place,
    fit_orientations,
)
from lobstr_hw.calibration.phases import Phases, tell_phases
from lobstr_hw.calibration.recording import RATE_HZ, Movement
from lobstr_hw.calibration.t_pose import TPose
from lobstr_hw.rotations import Array, geodesic_angle, rotation_y, transpose
from lobstr_hw.trackers import FOUR_POINTS

__all__ = ["Quantity", "Refinement", "refine_by_movement"]

_ROUNDS = 3
_LEAST_S = 2.0
_UNITS = {"degrees": 180.0 / np.pi, "cm": 100.0}


@dataclass(frozen=True, slots=True)
class Quantity:
    """How well something is known before and after the movement.

    Attributes:
        name: of it.
        unit: of both.
        before, after: how far off it may be (standard deviation).
        missing: what the movement would have had to show; empty where it did.
    """

    name: str
    unit: str
    before: float
    after: float
    missing: str = ""

    @property
    def refined(self) -> bool:
        """The movement told something about it."""
        return not self.missing


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """A calibration, and what the movement did for it.

    Attributes:
        calibration: to be used.
        quantities: each with its deviation before and after.
        measures: of the body and the mounts.
        held_rad: (4,) how far each joint was off the ideal T-pose.
    """

    calibration: Calibration
    quantities: tuple[Quantity, ...]
    measures: Measures
    held_rad: Array

    @property
    def missing(self) -> tuple[str, ...]:
        """What to do next time: parts of the movement that were not seen."""
        return tuple(dict.fromkeys(q.missing for q in self.quantities if q.missing))


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    orientations: Orientations
    levers: LeverPrior
    measures: Measures


def refine_by_movement(
    pose: TPose,
    movement: Movement,
    *,
    stature_m: float | None = None,
    floor_m: float = 0.0,
    created: str = "",
) -> Refinement:
    """Calibrate from a T-pose and what came after it.

    Args:
        pose: as the detector gives it.
        movement: of the same trackers, in the order of FOUR_POINTS; as long or short as it is.
        stature_m: overrules what the headset's height says.
        floor_m: height of the floor in the tracking space.
        created: when this is, in the caller's words.
    """
    before = _measured(pose, _oriented(pose, []), None, stature_m, floor_m)
    fit, told = before, dict.fromkeys(_MISSING, False)
    if len(movement) >= _LEAST_S * RATE_HZ:
        for _ in range(_ROUNDS):
            p, phases = _phases(movement, fit)
            M = fit.orientations.R_joint_tracker
            evidence, told = directions(movement, p, M, phases, before.orientations)
            usual = _usual(pose, fit.orientations)
            place = head_place(movement, M, phases, fit.measures.stature_m, usual)
            orientations = _oriented(pose, [*evidence, *place])
            levers, more = levers_from_movement(
                movement,
                p,
                orientations.R_joint_tracker,
                phases,
                fit.measures.stature_m,
                fit.measures.hips_height_m,
                _usual(pose, orientations),
            )
            told |= more
            fit = _measured(pose, orientations, levers, stature_m, floor_m)
    calibration = _calibration(pose, fit, floor_m, created)
    held = geodesic_angle(_held(pose, fit.orientations), np.eye(3))
    return Refinement(calibration, _quantities(before, fit, told), fit.measures, held)


def _oriented(pose: TPose, evidence: Sequence[Direction | Place]) -> Orientations:
    return fit_orientations(pose.R, float(hands_heading(pose.p[1], pose.p[2])), evidence)


def _held(pose: TPose, orientations: Orientations) -> Array:
    """Joints (4, 3, 3) in the T-pose, in the person's heading."""
    R_heading = rotation_y(orientations.heading_rad)
    return np.asarray(transpose(R_heading) @ pose.R @ transpose(orientations.R_joint_tracker))


def _usual(pose: TPose, orientations: Orientations) -> LeverPrior:
    held = _held(pose, orientations)
    usual = LeverPrior.usual(held[0])
    return LeverPrior(held, usual.mean, usual.deviation)


def _measured(
    pose: TPose,
    orientations: Orientations,
    levers: LeverPrior | None,
    stature_m: float | None,
    floor_m: float,
) -> _Fit:
    levers = _usual(pose, orientations) if levers is None else levers
    R_heading = rotation_y(orientations.heading_rad)
    p = (pose.p - np.array([0.0, floor_m, 0.0])) @ R_heading  # rows, so this is R^T p
    measures = fit_measures(p, levers.held[0], stature_m, levers)
    return _Fit(orientations, levers, measures)


def _phases(movement: Movement, fit: _Fit) -> tuple[Array, Phases]:
    M = fit.orientations.R_joint_tracker
    R = movement.R @ transpose(M)
    p = movement.p - (R @ fit.measures.levers[..., None])[..., 0]
    return p, tell_phases(p, R, RATE_HZ)


def _calibration(pose: TPose, fit: _Fit, floor_m: float, created: str) -> Calibration:
    M, measures = fit.orientations.R_joint_tracker, fit.measures
    straight = hands_heading(pose.p[1], pose.p[2])
    return Calibration(
        roles=dict(zip(pose.serials, FOUR_POINTS, strict=True)),
        R_tracker_joint=transpose(M),
        p_tracker_joint=-(transpose(M) @ measures.levers[..., None])[..., 0],
        body=measures.body(),
        stature_m=measures.stature_m,
        floor_m=floor_m,
        heading_rad=fit.orientations.heading_rad,
        residuals=Residuals(
            pose.spread_m,
            pose.spread_rad,
            fit.orientations.heading_rad - float(straight),
            measures.misfit,
            measures.hips_height_deviation_m,
            measures.arm_deviation_m,
        ),
        created=created,
    )


_MISSING = {
    "upright": "stand or walk upright for a second",
    "walking": "walk a few steps straight ahead",
    "nod": "nod",
    "shake": "shake your head",
    "left twist": "twist the left hand to and fro",
    "left bend": "bend the left wrist up and down",
    "right twist": "twist the right hand to and fro",
    "right bend": "bend the right wrist up and down",
    "head lever": "nod and shake your head while the rest of you stands still",
    "left wrist lever": "twist and bend the left wrist with the arm held still",
    "right wrist lever": "twist and bend the right wrist with the arm held still",
    "turn on the spot": "turn round on the spot",
    "bow": "bow with straight legs",
}


def _quantities(before: _Fit, after: _Fit, told: dict[str, bool]) -> tuple[Quantity, ...]:
    """Rows: name, what tells it, unit, value before, value after."""

    def turn(fit: _Fit, joint: int, *axes: int) -> float:
        return float(np.linalg.norm(fit.orientations.deviation[joint, list(axes)]))

    def lever(fit: _Fit, joint: int, *axes: int) -> float:
        return float(np.linalg.norm(fit.measures.lever_deviation[joint, list(axes)]))

    rows = [
        ("head, tilt", "upright", "degrees", turn, 0, (0, 2)),
        ("head, heading", "walking", "degrees", turn, 0, (1,)),
        ("left hand", "left twist", "degrees", turn, 1, (0, 1, 2)),
        ("right hand", "right twist", "degrees", turn, 2, (0, 1, 2)),
        ("pelvis, tilt", "upright", "degrees", turn, 3, (0, 2)),
        ("pelvis, heading", "walking", "degrees", turn, 3, (1,)),
        ("head lever", "head lever", "cm", lever, 0, (0, 1, 2)),
        ("left wrist lever", "left wrist lever", "cm", lever, 1, (0, 1, 2)),
        ("right wrist lever", "right wrist lever", "cm", lever, 2, (0, 1, 2)),
        ("hips, sideways", "turn on the spot", "cm", lever, 3, (0,)),
        ("hips, forward", "turn on the spot", "cm", lever, 3, (2,)),
    ]
    found = [
        Quantity(
            name,
            unit,
            _UNITS[unit] * of(before, joint, *axes),
            _UNITS[unit] * of(after, joint, *axes),
            "" if told[by] else _MISSING[by],
        )
        for name, by, unit, of, joint, axes in rows
    ]
    heights = [100.0 * fit.measures.hips_height_deviation_m for fit in (before, after)]
    return (*found, Quantity("hips height", "cm", heights[0], heights[1]))
