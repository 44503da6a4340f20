"""Somebody who moves to be calibrated: nods, twists the wrists, bows, takes steps, turns.

Everybody does it their own way. What a person keeps from take to take (:class:`Habits`) and what
differs each time are drawn apart, so that repeats can be told from accuracy. What is assumed about
people, and where it comes from, stands in docs/calibration.md.
"""

import numpy as np

from lobstr_hw.motion import Motion
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
from lobstr_hw.simulation.arms import pose_arms
from lobstr_hw.simulation.footsteps import Feet, Stepping, walked
from lobstr_hw.simulation.habits import Habits, Performance
from lobstr_hw.simulation.legs import LEGS, plant, rotations_to_ankles
from lobstr_hw.simulation.noise import smooth_noise
from lobstr_hw.simulation.timing import Plan, bump, cruise, ramp, waves
from lobstr_hw.skeleton import Joint, forward_kinematics, local_rotations

__all__ = ["calibrating_movement"]

RATE_HZ = 45.0


def calibrating_movement(
    habits: Habits, rng: np.random.Generator, now: Performance | None = None
) -> Motion:
    """About eight seconds on the standard skeleton at 45 Hz, from a T-pose at the origin.

    Args:
        habits: of the person.
        rng: of this time.
        now: how it goes this time; drawn where None.
    """
    now = Performance.drawn(rng) if now is None else now
    plan = Plan.of(habits, now)
    t = np.arange(round(plan.end_s * RATE_HZ) + 1) / RATE_HZ
    place, yaw, feet = _way(habits, now, plan, t, rng)
    R = np.broadcast_to(np.eye(3), (len(t), 22, 3, 3)).copy()
    p_hips = _trunk(habits, now, plan, t, place, yaw, feet, R, rng)
    _head(habits, now, plan, t, yaw, R, rng)
    pose_arms(habits, now, plan, t, R, rng)
    return _standing(p_hips, feet, R)


def _way(
    habits: Habits, now: Performance, plan: Plan, t: Array, rng: np.random.Generator
) -> tuple[Array, Array, Feet]:
    """Place of the hips on the floor (m, 2), heading of the body (m), and the feet."""
    # a body speeds up and slows down within about a step
    walked_m = now.steps * now.step_m * cruise(t, plan.walk)
    course = float(np.deg2rad(rng.normal(0.0, 3.0)))  # nobody walks quite where they look
    yaw = course * ramp(t, plan.walk) + now.turn_rad * cruise(t, plan.turn)
    direction = np.array([np.sin(course), np.cos(course)])
    turning = yaw - course * ramp(t, plan.walk)
    pivot = habits.pivot_m + now.pivot_m
    place = walked_m[:, None] * direction
    place = place + _level(course, pivot) - _level(course + turning, pivot)
    moving = bump(t, plan.turn, 0.6)[:, None]
    place = place + moving * smooth_noise(rng, t, 2, 0.015) + smooth_noise(rng, t, 2, 0.004)
    first = int(rng.integers(2))
    turn_steps = max(3, round(abs(now.turn_rad) / np.deg2rad(55.0)))
    parts = [
        Stepping(*plan.walk, now.steps + 1, first),
        Stepping(*plan.turn, turn_steps, int(now.turn_rad < 0.0)),
    ]
    turned_out = np.deg2rad(np.array([1.0, -1.0]) * rng.uniform(0.0, 12.0, 2))
    return place, yaw, walked(t, place, yaw, parts, turned_out)


def _level(yaw: Array | float, left_forward: Array) -> Array:
    """A point to the left and in front of a body of this yaw (...), on the floor (..., 2)."""
    left, forward = left_forward
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([c * left + s * forward, c * forward - s * left], axis=-1)


def _trunk(
    habits: Habits,
    now: Performance,
    plan: Plan,
    t: Array,
    place: Array,
    yaw: Array,
    feet: Feet,
    R: Array,
    rng: np.random.Generator,
) -> Array:
    """Fill in pelvis and back; where the hips are (m, 3)."""
    bow = now.bow_rad * bump(t, plan.bow)
    walking = bump(t, plan.walk, 0.6)
    side = feet.swinging[:, 1] - feet.swinging[:, 0]  # weight on the left foot: 1
    sway = smooth_noise(rng, t, 6, np.deg2rad(0.5))
    facing = rotation_y(yaw)
    tip = now.bow_share * bow + walking * habits.walking[0] + sway[:, 0]
    # the side whose leg swings comes forward and sinks
    turned = np.deg2rad(5.0) * side * walking + now.bow_twist[0] * bow
    turned = turned + walking * (habits.walking[1] + now.walk_yaw) + sway[:, 1]
    roll = np.deg2rad(2.5) * side * walking + now.bow_twist[1] * bow + sway[:, 2]
    posture = from_rotation_vector(now.posture_pelvis)
    pelvis = facing @ rotation_y(turned) @ rotation_x(tip) @ rotation_z(roll) @ posture
    lean = bow + walking * np.deg2rad(2.0) + sway[:, 3]
    back = facing @ rotation_y(-0.6 * turned + sway[:, 4]) @ rotation_x(lean)
    back = back @ rotation_z(-0.5 * roll + sway[:, 5])
    R[:, Joint.HIPS] = pelvis
    for joint, share in ((Joint.SPINE, 0.35), (Joint.CHEST, 0.7), (Joint.UPPER_CHEST, 1.0)):
        R[:, joint] = slerp(pelvis, back, share)
    R[:, [Joint.LEFT_SHOULDER, Joint.RIGHT_SHOULDER]] = back[:, None]
    # the weight stays over the feet: hips go back as the trunk goes forward
    backward = 0.10 * np.sin(bow) * (0.8 + 0.4 * habits.tempo * (1.0 - now.bow_share))
    level = place - _level(yaw, np.array([0.0, 1.0])) * backward[:, None]
    level = level + 0.02 * (side * walking)[:, None] * _level(yaw, np.array([1.0, 0.0]))
    bob = np.max(feet.swinging, axis=1)  # highest over the standing foot
    height = 1.0 - 0.002 - walking * (0.025 - 0.02 * bob) - habits.knees * backward
    return np.stack([level[:, 0], height, level[:, 1]], axis=-1)


def _head(
    habits: Habits,
    now: Performance,
    plan: Plan,
    t: Array,
    yaw: Array,
    R: Array,
    rng: np.random.Generator,
) -> None:
    """Fill in neck and head."""
    a, b = plan.gestures
    middle = a + (b - a) * rng.uniform(0.4, 0.6)
    nod = waves(t, (a, middle), now.nods, now.nod_rad)
    shake = waves(t, (middle - 0.1, b), now.shakes, now.shake_rad)
    wobble = smooth_noise(rng, t, 3, np.deg2rad(1.0))
    nod_axis = from_rotation_vector(now.nod_slip) @ habits.nod_axis
    shake_axis = from_rotation_vector(now.shake_slip) @ habits.shake_axis
    posture = from_rotation_vector(now.posture_head)
    # in a bow some go on looking ahead and some look at the floor
    follow = rng.uniform(0.3, 1.0)
    level = slerp(rotation_y(yaw), R[:, Joint.UPPER_CHEST], follow * bump(t, plan.bow, 0.5))
    # who turns looks ahead of the turn
    ahead = np.sign(now.turn_rad) * np.deg2rad(rng.uniform(5.0, 25.0)) * bump(t, plan.turn)
    base = level @ rotation_y(ahead) @ from_rotation_vector(wobble)

    def turned(share_nod: float, share_shake: float) -> Array:
        down = from_axis_angle(normalize(nod_axis), share_nod * nod)
        return np.asarray(from_axis_angle(normalize(shake_axis), share_shake * shake) @ down)

    R[:, Joint.HEAD] = base @ turned(1.0, 1.0) @ posture
    R[:, Joint.NECK] = slerp(R[:, Joint.UPPER_CHEST], base, 0.5) @ turned(habits.neck_share, 0.3)


def _standing(p_hips: Array, feet: Feet, R: Array) -> Motion:
    """The motion of these world rotations with the legs put under the hips."""
    hips = plant(p_hips, R[:, 0], feet.p, 0.004)
    middle = slerp(feet.R[:, 0], feet.R[:, 1], 0.5)
    like = np.broadcast_to(heading(middle)[:, None, None], (len(R), 2, 2, 3, 3))
    R[:, LEGS[:, :2]] = rotations_to_ankles(hips, R[:, 0], feet.p, like)
    R[:, LEGS[:, 2]] = feet.R
    # toes stay flat while the heel rises
    flat = np.stack([heading(feet.R[:, i]) for i in (0, 1)], axis=1)
    R[:, LEGS[:, 3]] = flat
    R_local = local_rotations(R)
    p_toes = forward_kinematics(R_local, hips)[0][:, LEGS[:, 3]]
    return Motion("movement", "simulated", RATE_HZ, hips, R_local, p_toes, 1.0)
