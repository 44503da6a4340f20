"""Body measures and levers from where four trackers are in a T-pose: the most likely ones.

Everything unknown is normally distributed (priors.py), the twelve coordinates follow from it, so
the answer is a weighted least-squares fit (Gauss-Newton; the model is nearly linear).
What eyes, hands and belt say about the hips is combined with the right weights by itself: a
centimetre of the headset's height raises the hips by 0.40 cm, one of the belt tracker's by 0.23, of
both hands' by 0.07, and a centimetre of the span by 0.03 (derived in docs/calibration.md).
"""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.priors import (
    ARM_DEVIATION,
    ARM_LIFT_DEVIATIONS,
    BELLY_LEVER,
    BELLY_LEVER_DEVIATION,
    EYES_DEVIATION,
    EYES_OF_STATURE,
    HIPS_OF_STATURE,
    LEG_DEVIATION,
    TRUNK_DEVIATION,
    WAND_LEVER,
    WAND_LEVER_DEVIATION,
)
from lobstr_hw.poses import frozen
from lobstr_hw.proportions import (
    STANDARD_ARM,
    STANDARD_TRUNK,
    STANDARD_WIDTH,
    body_from_measures,
    eyes_in_head,
)
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import STANDARD_OFFSETS, STATURE, Body, Joint

__all__ = ["LeverPrior", "Measures", "fit_measures"]

STEPS = 8
_FREE_M = 100.0  # no opinion
_GIVEN_M = 0.0005  # what somebody typed in overrules the headset
_MEASURED_M = np.array([0.006, 0.012, 0.012, 0.012])
"""Of a tracker's position in the pose: tracking, sway, and the lever of a segment that is off."""
_SHOULDER_OF_TRUNK = (
    float(
        sum(
            STANDARD_OFFSETS[j, 1]
            for j in (
                Joint.SPINE,
                Joint.CHEST,
                Joint.UPPER_CHEST,
                Joint.LEFT_SHOULDER,
                Joint.LEFT_UPPER_ARM,
            )
        )
    )
    / STANDARD_TRUNK
)
_MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Measures:
    """The most likely body and mounts.

    Attributes:
        stature_m, hips_height_m, trunk_m, arm_m, shoulders_m: see ``body_from_measures``.
        levers: (4, 3) from joint to tracker, in the joint's frame; FOUR_POINTS.
        lever_deviation: (4, 3) how far off these may be.
        arms_rad: (2, 2) each arm in the T-pose: up, forward; left first.
        leg: of the hips' height, by what share it is off that of people of this stature.
        hips_height_deviation_m: how far off the hips' height may be.
        arm_deviation_m: how far off the arms may be.
        misfit: root mean square of all residuals over their deviations; the self-check refuses
            more than 1.8.
    """

    stature_m: float
    hips_height_m: float
    trunk_m: float
    arm_m: float
    shoulders_m: float
    levers: Array
    lever_deviation: Array
    arms_rad: Array
    leg: float
    hips_height_deviation_m: float
    arm_deviation_m: float
    misfit: float

    def __post_init__(self) -> None:
        """Check the shape once."""
        object.__setattr__(self, "levers", frozen(self.levers, (4, 3)))
        object.__setattr__(self, "lever_deviation", frozen(self.lever_deviation, (4, 3)))
        object.__setattr__(self, "arms_rad", frozen(self.arms_rad, (2, 2)))

    def body(self) -> Body:
        """The body of these measures (n = 1)."""
        parts = (self.hips_height_m, self.trunk_m, self.arm_m, self.shoulders_m)
        return body_from_measures(*(np.array([part]) for part in parts))


@dataclass(frozen=True, slots=True, eq=False)
class LeverPrior:
    """What is known beforehand about where trackers sit, and how their joints are held.

    Attributes:
        held: (4, 3, 3) joints in the T-pose, in the person's heading; FOUR_POINTS.
        mean: (4, 3) from joint to tracker, in the joint's frame; the headset's from the eyes.
        deviation: (4, 3) of these.
    """

    held: Array
    mean: Array
    deviation: Array

    @staticmethod
    def usual(R_head: Array) -> "LeverPrior":
        """Of people in general; all but the head held straight."""
        held = np.stack([R_head, *np.broadcast_to(np.eye(3), (3, 3, 3))])
        mean = np.stack([np.zeros(3), WAND_LEVER, WAND_LEVER * _MIRROR, BELLY_LEVER])
        deviation = np.stack(
            [EYES_DEVIATION, WAND_LEVER_DEVIATION, WAND_LEVER_DEVIATION, BELLY_LEVER_DEVIATION]
        )
        return LeverPrior(held, mean, deviation)


# the unknowns, in this order, each as its distance from the mean in deviations
_SIZES = slice(0, 4)  # stature (metres), leg, arm, shoulders (fractions)
_PLACE = slice(4, 6)  # of the hips on the floor
_LEAN = slice(6, 8)  # of the back, forward and to the left
_ARMS = slice(8, 12)  # left up, left forward, right up, right forward
_LEVERS = slice(12, 24)


def fit_measures(
    p: Array,
    R_head: Array,
    stature_m: float | None = None,
    levers: LeverPrior | None = None,
) -> Measures:
    """Measure a person in a T-pose.

    Args:
        p: (4, 3) tracker positions in the order of FOUR_POINTS, in the person's heading, above the
            floor.
        R_head: (3, 3) how the head is held, in the person's heading.
        stature_m: where the person knows it.
        levers: where more is known about the trackers than of people in general; R_head is then
            not looked at.
    """
    levers = LeverPrior.usual(R_head) if levers is None else levers
    mean, deviation = _prior(p, stature_m, levers)
    weight = np.repeat(1.0 / _MEASURED_M, 3)
    u = np.zeros(len(mean))
    for _ in range(STEPS):
        at, J = _linearized(u, mean, deviation, levers.held)
        J = J * weight[:, None]
        residual = weight * (p.ravel() - at) + J @ u
        spread = np.linalg.inv(J.T @ J + np.eye(len(u)))
        u = spread @ (J.T @ residual)
    found = mean + deviation * u
    left = weight * (p.ravel() - _trackers(found, levers.held).ravel())
    informed = deviation < _FREE_M
    return _measures(
        found,
        spread * np.outer(deviation, deviation),
        float(np.sqrt((np.sum(left**2) + np.sum(u[informed] ** 2)) / len(left))),
    )


def _prior(p: Array, stature_m: float | None, levers: LeverPrior) -> tuple[Array, Array]:
    """Mean and deviation (24,) of the unknowns; the stature's and the place's are only starts."""
    stature = p[0, 1] / EYES_OF_STATURE if stature_m is None else stature_m
    mean = np.zeros(24)
    mean[0] = stature
    mean[_PLACE] = (p[3] - levers.held[3] @ levers.mean[3])[[0, 2]]
    mean[_LEVERS] = levers.mean.ravel()
    sizes = [
        _FREE_M if stature_m is None else _GIVEN_M,
        LEG_DEVIATION,
        ARM_DEVIATION,
        ARM_DEVIATION,
    ]
    deviation = np.concatenate(
        [
            sizes,
            np.full(2, _FREE_M),
            np.full(2, TRUNK_DEVIATION),
            np.tile(ARM_LIFT_DEVIATIONS, 2),
            levers.deviation.ravel(),
        ]
    )
    return mean, deviation


def _linearized(u: Array, mean: Array, deviation: Array, held: Array) -> tuple[Array, Array]:
    """The twelve coordinates at u and their derivatives (12, 24), by central differences."""
    step_m = 1e-6 / np.minimum(deviation, 1.0)  # a micrometre (or microradian) of each unknown
    around = u + np.concatenate([np.diag(step_m), -np.diag(step_m)])
    values = _trackers(mean + deviation * around, held).reshape(len(around), -1)
    plus, minus = np.split(values, 2)
    at = _trackers(mean + deviation * u, held).ravel()
    return at, ((plus - minus) / (2.0 * step_m[:, None])).T


def _sizes(x: Array) -> tuple[Array, Array, Array, Array]:
    """Hips' height, trunk, arm and shoulders (...) in metres, of unknowns x (..., 24)."""
    stature, leg, arm, shoulders = np.moveaxis(x[..., _SIZES], -1, 0)
    size = stature / STATURE
    hips = HIPS_OF_STATURE * stature * (1.0 + leg)
    trunk = EYES_OF_STATURE * stature - eyes_in_head(stature)[..., 1] - hips
    return hips, trunk, STANDARD_ARM * size * (1.0 + arm), STANDARD_WIDTH * size * (1.0 + shoulders)


def _trackers(x: Array, held: Array) -> Array:
    """Where the four trackers (..., 4, 3) are for unknowns x (..., 24), joints held so."""
    hips_height, trunk, arm, shoulders = _sizes(x)
    hips = np.stack([x[..., 4], hips_height, x[..., 5]], axis=-1)
    forward, left = np.moveaxis(x[..., _LEAN], -1, 0)
    up = np.stack([left, _rest(forward, left), forward], axis=-1)
    levers = np.array(x[..., _LEVERS]).reshape(*x.shape[:-1], 4, 3)
    levers[..., 0, :] += eyes_in_head(x[..., 0])
    levers = (held @ levers[..., None])[..., 0]
    joints = [hips + trunk[..., None] * up + levers[..., 0, :]]
    for i, side in enumerate((1.0, -1.0)):
        lift, ahead = x[..., 8 + 2 * i], x[..., 9 + 2 * i]
        out = np.stack([side * _rest(lift, ahead), lift, ahead], axis=-1)
        shoulder = hips + _SHOULDER_OF_TRUNK * trunk[..., None] * up
        width = side * shoulders[..., None] / 2.0 * np.array([1.0, 0.0, 0.0])
        joints.append(shoulder + width + arm[..., None] * out + levers[..., 1 + i, :])
    return np.stack([*joints, hips + levers[..., 3, :]], axis=-2)


def _rest(a: Array, b: Array) -> Array:
    """The third component of a unit vector; a pose that is none may ask for more than there is."""
    return np.asarray(np.sqrt(np.maximum(1.0 - a**2 - b**2, 1e-4)))


def _measures(x: Array, covariance: Array, misfit: float) -> Measures:
    hips, trunk, arm, shoulders = (float(v) for v in _sizes(x))
    levers = np.array(x[_LEVERS]).reshape(4, 3)
    levers[0] += eyes_in_head(x[0])
    # hips = 0.586 H (1 + leg) and arm = k H (1 + arm): deviations through both factors
    by_hips = np.array([hips / x[0], hips / (1.0 + x[1])])
    by_arm = np.array([arm / x[0], arm / (1.0 + x[2])])
    C = covariance
    return Measures(
        float(x[0]),
        hips,
        trunk,
        arm,
        shoulders,
        levers,
        np.sqrt(np.diag(C)[_LEVERS]).reshape(4, 3),
        np.array(x[_ARMS]).reshape(2, 2),
        float(x[1]),
        float(np.sqrt(by_hips @ C[:2, :2] @ by_hips)),
        float(np.sqrt(by_arm @ C[np.ix_([0, 2], [0, 2])] @ by_arm)),
        misfit,
    )
