"""The metrics (their words are used for nothing else). The first second of a clip is not scored.

Contact accuracy: share of frames and feet with the right label. Balanced accuracy: mean of the two
recalls. Rotation error: mean geodesic angle over C, U, L, F of both sides; legs-only without C.
Position error: of the toe bases, the truth's root and heading given. Velocity error: mean norm of
the difference of the toe bases' velocities. Skate: horizontal toe-base speed while the truth is in
contact; held skate: the same while the scored legs say themselves that the foot stands, in this
frame and the one before (after IK: while the lock is closed). Jitter ratio: mean norm of the third
difference of the toe bases over the truth's. Penetration: mean depth of the lowest of heel, toe
base and tip under the floor. Lengths are of the standard skeleton (hips at 1.0 m).
"""

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.lower_body import LEG_JOINTS, toes_in_reference
from lobstr_hw.rotations import Array, geodesic_angle
from lobstr_hw.skeleton import HEEL, STANDARD_OFFSETS, TOE_TIP

__all__ = ["Legs", "Scores", "Tally", "network_legs", "tally"]

Bools = npt.NDArray[np.bool_]
Scores = dict[str, float | int | None]

NOT_SCORED_S = 1.0
_FOOT_TO_TOES: Array = STANDARD_OFFSETS[[leg[3] for leg in LEG_JOINTS]]


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """What is scored.

    Attributes:
        joints: (frames, 2, 4, 3, 3) C, U, L, F.
        p_toes: (frames, 2, 3) toe bases in the world, on the true root.
        contact: (frames, 2) said to be on the floor.
    """

    joints: Array
    p_toes: Array
    contact: Bools


def network_legs(truth: Truth, joints: Array, contact: Array) -> Legs:
    """What a network said: FK with C on the true root; contact by p > 0.5."""
    toes = (truth.R_ref[:, None] @ toes_in_reference(joints)[..., None])[..., 0]
    return Legs(joints, truth.p_hips[:, None] + toes, contact > 0.5)


@dataclass(frozen=True, slots=True)
class Tally:
    """Sums over frames and feet; tallies of clips add up."""

    frames: int = 0
    true_on: int = 0
    true_off: int = 0
    right_on: int = 0
    right_off: int = 0
    right_paper: int = 0
    rotation_rad: float = 0.0
    rotation_legs_rad: float = 0.0
    position_m: float = 0.0
    penetration_m: float = 0.0
    steps: int = 0
    velocity_m_s: float = 0.0
    skate_steps: int = 0
    skate_m_s: float = 0.0
    truth_skate_m_s: float = 0.0
    held_steps: int = 0
    held_skate_m_s: float = 0.0
    jitter: float = 0.0
    truth_jitter: float = 0.0

    def __add__(self, other: "Tally") -> "Tally":
        """Of both."""
        names = [f.name for f in fields(Tally)]
        return Tally(**{name: getattr(self, name) + getattr(other, name) for name in names})

    def scores(self) -> Scores:
        """The metrics; None where nothing was there to score."""
        feet, labels = 2 * self.frames, self.true_on + self.true_off
        recalls = (_ratio(self.right_on, self.true_on), _ratio(self.right_off, self.true_off))
        known = [recall for recall in recalls if recall is not None]
        return {
            "frames": self.frames,
            "contact_accuracy": _ratio(self.right_on + self.right_off, labels),
            "contact_balanced_accuracy": sum(known) / len(known) if known else None,
            "contact_accuracy_1cm": _ratio(self.right_paper, feet),
            "rotation_error_deg": _ratio(np.rad2deg(self.rotation_rad), self.frames),
            "rotation_error_legs_deg": _ratio(np.rad2deg(self.rotation_legs_rad), self.frames),
            "position_error_cm": _ratio(100.0 * self.position_m, feet),
            "skate_cm_s": _ratio(100.0 * self.skate_m_s, self.skate_steps),
            "truth_skate_cm_s": _ratio(100.0 * self.truth_skate_m_s, self.skate_steps),
            "held_skate_cm_s": _ratio(100.0 * self.held_skate_m_s, self.held_steps),
            "velocity_error_cm_s": _ratio(100.0 * self.velocity_m_s, 2 * self.steps),
            "jitter_ratio": _ratio(self.jitter, self.truth_jitter),
            "penetration_cm": _ratio(100.0 * self.penetration_m, feet),
        }


def _ratio(total: float, count: float) -> float | None:
    return float(total / count) if count else None


def tally(truth: Truth, legs: Legs) -> Tally:
    """Compare legs with the truth of the same clip."""
    first = round(NOT_SCORED_S * truth.rate_hz)
    if len(truth) <= first:
        return Tally()
    scored = slice(first, None)
    joints, true_joints = legs.joints[scored], truth.joints[scored]
    angle = geodesic_angle(joints, true_joints)  # (frames, 2, 4)
    toes, true_toes = legs.p_toes[scored], truth.p_toes[scored]
    said, true_contact = legs.contact[scored], truth.contact[scored]
    right = said == true_contact
    v, true_v = np.diff(toes, axis=0) * truth.rate_hz, np.diff(true_toes, axis=0) * truth.rate_hz
    standing, held = true_contact[1:], said[1:] & said[:-1]
    return Tally(
        frames=len(toes),
        true_on=int(true_contact.sum()),
        true_off=int((~true_contact).sum()),
        right_on=int(right[true_contact].sum()),
        right_off=int(right[~true_contact].sum()),
        right_paper=int((said == truth.paper_contact[scored]).sum()),
        rotation_rad=float(angle.mean(axis=(1, 2)).sum()),
        rotation_legs_rad=float(angle[..., 1:].mean(axis=(1, 2)).sum()),
        position_m=float(np.linalg.norm(toes - true_toes, axis=-1).sum()),
        penetration_m=float(_depth(joints, truth.R_ref[scored], toes).sum()),
        steps=len(v),
        velocity_m_s=float(np.linalg.norm(v - true_v, axis=-1).sum()),
        skate_steps=int(standing.sum()),
        skate_m_s=float(_horizontal_speed(v)[standing].sum()),
        truth_skate_m_s=float(_horizontal_speed(true_v)[standing].sum()),
        held_steps=int(held.sum()),
        held_skate_m_s=float(_horizontal_speed(v)[held].sum()),
        jitter=_jitter(toes),
        truth_jitter=_jitter(true_toes),
    )


def _horizontal_speed(v: Array) -> Array:
    return np.asarray(np.linalg.norm(v[..., [0, 2]], axis=-1))


def _jitter(toes: Array) -> float:
    return float(np.linalg.norm(np.diff(toes, n=3, axis=0), axis=-1).sum())


def _depth(joints: Array, R_ref: Array, p_toes: Array) -> Array:
    """How far the lowest point of each foot (frames, 2) is under the floor, the toes straight."""
    C, U, L, F = (joints[:, :, i] for i in range(4))
    R_foot = R_ref[:, None] @ C @ U @ L @ F
    to_heel = (R_foot @ (HEEL - _FOOT_TO_TOES)[..., None])[..., 0]
    to_tip = R_foot @ TOE_TIP
    lowest = np.minimum(np.minimum(to_heel[..., 1], to_tip[..., 1]), 0.0) + p_toes[..., 1]
    return np.maximum(-lowest, 0.0)
