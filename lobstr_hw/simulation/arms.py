"""Arms and hands of somebody who moves to be calibrated."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.rotations import (
    Array,
    from_axis_angle,
    from_rotation_vector,
    heading,
    normalize,
    rotation_x,
    rotation_y,
    rotation_z,
    slerp,
)
from lobstr_hw.simulation.habits import Habits, Performance, degrees_off
from lobstr_hw.simulation.noise import smooth_noise
from lobstr_hw.simulation.timing import Plan, bump, ramp, waves
from lobstr_hw.skeleton import Joint

__all__ = ["pose_arms"]

_JOINTS = (
    (Joint.LEFT_UPPER_ARM, Joint.LEFT_LOWER_ARM, Joint.LEFT_HAND),
    (Joint.RIGHT_UPPER_ARM, Joint.RIGHT_LOWER_ARM, Joint.RIGHT_HAND),
)


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """One arm, and how it does this time.

    Attributes:
        i: 0 is the left one.
        twist, bend: (m,) angles of the hand.
        hang: (m,) 0 with the arm out, 1 with it hanging.
        swing: (m,) angle in walking.
        sign: of the twist: both hands the same way round, or mirrored.
    """

    i: int
    twist: Array
    bend: Array
    hang: Array
    swing: Array
    sign: float

    @property
    def side(self) -> float:
        """1 to the left, -1 to the right."""
        return 1.0 if self.i == 0 else -1.0

    @property
    def flip(self) -> Array:
        """What mirrors a rotation vector left and right."""
        return np.array([1.0, self.side, self.side])


def pose_arms(
    habits: Habits,
    now: Performance,
    plan: Plan,
    t: Array,
    R: Array,
    rng: np.random.Generator,
) -> None:
    """Fill in arms and hands: out to the sides, then hanging.

    Args:
        habits: of the person.
        now: how it goes this time.
        plan: when.
        t: (m,) seconds.
        R: (m, 22, 3, 3) in the world; the chest is known, the arms are written.
        rng: of this time.
    """
    a, b = plan.gestures
    middle = a + (b - a) * rng.uniform(0.45, 0.6)
    together = rng.random() < 0.5
    hang = ramp(t, plan.lower)
    # a bow with arms hanging: they stay vertical
    plumb = slerp(R[:, Joint.UPPER_CHEST], heading(R[:, Joint.UPPER_CHEST]), 0.8 * hang)
    swing = np.deg2rad(12.0) * bump(t, plan.walk) * np.sin(2.0 * np.pi * 0.9 * t)
    for i in (0, 1):
        late = rng.uniform(-0.1, 0.1)
        twist = waves(t - late, (a, middle), now.twists, np.full(2, now.twist_rad[i]))
        bend = waves(t - late, (middle - 0.05, b), now.bends, np.full(2, now.bend_rad[i]))
        sign = 1.0 if together or i == 0 else -1.0
        _pose_arm(habits, now, _Side(i, twist, bend, hang, swing, sign), t, plumb, R, rng)


def _pose_arm(
    habits: Habits,
    now: Performance,
    arm: _Side,
    t: Array,
    plumb: Array,
    R: Array,
    rng: np.random.Generator,
) -> None:
    upper, lower, hand = _JOINTS[arm.i]
    side, flip, hang = arm.side, arm.flip, arm.hang
    droop = np.deg2rad(rng.normal(6.0, 5.0)) + hang * np.deg2rad(rng.uniform(68.0, 78.0))
    ahead = np.deg2rad(rng.normal(3.0, 3.0))
    # an arm gives way a little to what its hand does
    give = np.deg2rad(rng.uniform(-2.0, 3.0)) * arm.bend / now.bend_rad[arm.i]
    moving = smooth_noise(rng, t, 3, np.deg2rad(1.2))
    droop = droop + give + moving[:, 0]
    aim = rotation_z(-side * droop) @ rotation_y(-side * (ahead + moving[:, 1]))
    R[:, upper] = plumb @ rotation_x(side * arm.swing) @ aim
    elbow = np.deg2rad(rng.uniform(1.0, 8.0)) + hang * np.deg2rad(rng.uniform(4.0, 18.0))
    roll = np.deg2rad(rng.normal(0.0, 15.0)) * hang  # hanging hands turn inwards or outwards
    turned = arm.sign * arm.twist + roll
    slack = smooth_noise(rng, t, 3, np.deg2rad(1.5)) * flip
    twist = from_axis_angle(_own(now.twist_slip, habits.twist_axis, arm), turned)
    bend = from_axis_angle(_own(now.bend_slip, habits.bend_axis, arm), arm.bend)
    carried = R[:, upper] @ rotation_y(-side * elbow)
    R[:, lower] = carried @ rotation_x(turned)
    rest = from_rotation_vector(flip * degrees_off(rng, 3.0, 4.0, 4.0))
    R[:, hand] = carried @ rest @ twist @ bend @ from_rotation_vector(slack)


def _own(slip: Array, axis: Array, arm: _Side) -> Array:
    """The axis (3,) about which this hand turns this time."""
    return normalize(arm.flip * (from_rotation_vector(slip[arm.i]) @ axis[arm.i]))
