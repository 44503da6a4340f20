"""Is this calibration right? Checks that need no truth, each with the reason and what to do."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.movement import Refinement
from lobstr_hw.calibration.recording import Movement
from lobstr_hw.calibration.slips import steps_of
from lobstr_hw.calibration.t_pose import Check, TPose
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

__all__ = ["SelfCheck", "check_calibration"]

_HEAD, _PELVIS = FOUR_POINTS.index(TrackerRole.HEAD), FOUR_POINTS.index(TrackerRole.PELVIS)
BEFORE_S, AFTER_S = 0.7, 0.9
"""Around the T-pose's window, looked at for trackers that slip; the pose is held that long."""
_FROZEN_M = 2e-6
_UP_SHARE = 0.1
_HIGHER_M = 0.1
"""Simulated people who stood are at most 3 cm higher later, toes lift some 8 at times; who gets up
from a seat of two thirds of their hips' height is 25 cm higher or more."""


@dataclass(frozen=True, slots=True)
class SelfCheck:
    """All checks of one calibration."""

    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Nothing is wrong."""
        return all(check.ok for check in self.checks)

    @property
    def failed(self) -> tuple[Check, ...]:
        """What is wrong, the worst first."""
        failed = [check for check in self.checks if not check.ok]
        return tuple(sorted(failed, key=lambda check: -check.excess))

    @property
    def reason(self) -> str:
        """In words; empty when nothing is wrong."""
        return "; ".join(str(check) for check in self.failed)


def check_calibration(pose: TPose, recording: Movement, refinement: Refinement) -> SelfCheck:
    """Look at a calibration from all sides.

    Args:
        pose: the T-pose that it was made from.
        recording: all four trackers from 0.7 s before the pose to the end of the movement; without
            movement, to 0.9 s after the pose.
        refinement: what came of it.
    """
    return SelfCheck(
        (
            *pose.quality.checks,
            *_slips(recording.between(pose.start_s - BEFORE_S, pose.end_s + AFTER_S)),
            *_sight(recording),
            _stood(pose, recording.between(pose.end_s)),
            *_person(refinement),
        )
    )


def _slips(pose: Movement) -> list[Check]:
    step = steps_of(pose)
    again = "tracker moved on you during the T-pose: fasten it, and do the T-pose again"
    return [
        check
        for i, role in enumerate(FOUR_POINTS)
        for check in (
            Check(f"{role} step", 100.0 * float(step.m[i]), 0.0, 1.5, "cm", f"the {role} {again}"),
            Check(
                f"{role} twist",
                float(np.rad2deg(step.rad[i])),
                0.0,
                4.5,
                "degrees",
                f"the {role} {again}",
            ),
        )
    ]


def _sight(recording: Movement) -> list[Check]:
    """Every tracker was seen most of the time, and lives."""
    found = []
    for i, role in enumerate(FOUR_POINTS):
        seen = float(np.mean(recording.tracked[:, i])) if len(recording) else 0.0
        advice = f"bring the {role} tracker into sight of the base stations, and calibrate again"
        found.append(Check(f"{role} seen", 100.0 * seen, 60.0, 100.0, "%", advice))
        moved = float(np.sum(np.ptp(recording.p[:, i], axis=0))) if len(recording) else 0.0
        alive = "its poses do not change at all: switch it off and on again"
        found.append(Check(f"{role} alive", min(moved, 9.0), _FROZEN_M, 9.0, "m", alive))
    return found


def _stood(pose: TPose, movement: Movement) -> Check:
    """Nobody grows: who is higher for a tenth of the movement did not stand in the pose."""
    higher = np.zeros(1)
    if len(movement):
        rise = movement.p[:, [_HEAD, _PELVIS], 1] - pose.p[[_HEAD, _PELVIS], 1]
        higher = np.maximum(np.min(rise, axis=-1), 0.0)
    return Check(
        "height gained",
        100.0 * float(np.quantile(higher, 1.0 - _UP_SHARE)),
        0.0,
        100.0 * _HIGHER_M,
        "cm",
        "you were higher in the movement than in the T-pose: stand up straight, and do both again",
    )


def _person(refinement: Refinement) -> list[Check]:
    """The body and the pose are those of a person who stands in a T-pose."""
    fit = refinement.measures
    up, forward = np.rad2deg(fit.arms_rad).T
    held = np.rad2deg(refinement.held_rad)
    stand = "stand up straight; is the floor of the tracking space at height 0?"
    checks = [
        Check("fits a person", fit.misfit, 0.0, 1.8, "deviations", stand),
        Check("legs", 100.0 * fit.leg, -9.0, 9.0, "%", stand),
        *(
            Check(
                f"{side} arm {way}",
                float(value),
                -22.0,
                22.0,
                "degrees",
                f"hold the {side} arm level, straight out to the side",
            )
            for way, values in (("raised", up), ("forward", forward))
            for side, value in zip(("left", "right"), values, strict=True)
        ),
    ]
    for role, angle in zip(FOUR_POINTS, held, strict=True):
        checks.append(
            Check(
                f"{role} held",
                float(angle),
                0.0,
                25.0,
                "degrees",
                f"the {role} was turned in the T-pose, or its tracker since: do both again",
            )
        )
    return checks
