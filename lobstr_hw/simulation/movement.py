"""Somebody who moves to be calibrated: nods, twists the wrists, bows, takes steps, turns.

Everybody does it their own way. What a person keeps from take to take (:class:`Habits`) and what
differs each time are drawn apart, so that repeats can be told from accuracy. What is assumed about
people, and where it comes from, stands in docs/calibration.md.
"""

from dataclasses import dataclass

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
from lobstr_hw.simulation.footsteps import Feet, Stepping, minimum_jerk, walked
from lobstr_hw.simulation.legs import LEGS, plant, rotations_to_ankles
from lobstr_hw.simulation.noise import smooth_noise
from lobstr_hw.skeleton import Joint, forward_kinematics, local_rotations

__all__ = ["Habits", "Performance", "calibrating_movement"]

RATE_HZ = 45.0


def _degrees(rng: np.random.Generator, *deviations: float) -> Array:
    return np.asarray(np.deg2rad(rng.normal(0.0, 1.0, len(deviations)) * deviations))


@dataclass(frozen=True, slots=True, eq=False)
class Habits:
    """How one person does it, every time.

    Attributes:
        nod_axis, shake_axis: (3,) in the head, about which it goes up and down, left and right.
        twist_axis, bend_axis: (2, 3) in each hand (the left one's frame, mirrored for the right),
            about which the forearm turns it and the wrist lets it go up and down.
        neck_share: of a nod, from the neck's lower end; the rest is at the skull's base.
        walking: (2,) how much further forward the pelvis tips in walking, and its yaw.
        pivot_m: (2,) to the left of and in front of the hips: about where the person turns.
        knees: how far the hips sink in a bow, as a share of how far they go back.
        tempo: above 1 is faster.
    """

    nod_axis: Array
    shake_axis: Array
    twist_axis: Array
    bend_axis: Array
    neck_share: float
    walking: Array
    pivot_m: Array
    knees: float
    tempo: float

    @staticmethod
    def drawn(rng: np.random.Generator) -> "Habits":
        """Somebody."""
        nod, shake = _degrees(rng, 0.0, 2.0, 2.0), _degrees(rng, 4.0, 0.0, 2.5)
        twist = np.stack([_degrees(rng, 0.0, 4.0, 4.0) for _ in range(2)])
        bend = np.stack([_degrees(rng, 5.0, 5.0, 0.0) for _ in range(2)])
        return Habits(
            nod_axis=from_rotation_vector(nod)[:, 0],
            shake_axis=from_rotation_vector(shake)[:, 1],
            twist_axis=from_rotation_vector(twist)[..., 0],
            bend_axis=from_rotation_vector(bend)[..., 2],
            neck_share=float(rng.uniform(0.15, 0.5)),
            walking=np.deg2rad([1.0, 0.0]) + _degrees(rng, 1.0, 1.5),
            pivot_m=rng.normal(0.0, 1.0, 2) * (0.008, 0.015),
            knees=float(rng.uniform(0.0, 0.35)),
            tempo=float(rng.uniform(1.1, 1.4)),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Performance:
    """How it went this time.

    Attributes:
        nods, shakes, twists, bends: how often.
        nod_rad, shake_rad: (2,) how far down and up, left and right.
        twist_rad, bend_rad: (2,) of each hand, to each side.
        twist_slip, bend_slip: (2, 3) axis of each hand off its habit, rotation vectors.
        nod_slip, shake_slip: (3,) the same of the head.
        posture_pelvis, posture_head: (3,) how these are held, as rotation vectors; off what the
            person holds them like on the whole, which is what their frames are.
        bow_rad: of the trunk.
        bow_share: of the pelvis in it.
        bow_twist: yaw and roll on the way, as shares of the bow.
        steps: taken forward.
        step_m: length of each.
        walk_yaw: of the pelvis against the way, off the habit.
        turn_rad: on the spot; negative to the right.
        pivot_m: (2,) off the habit.
        bow_first: before the steps, or after the turn.
        arms_out: nods and twists with the arms still out; else lowers them before.
        tempo: on top of the habit's.
    """

    nods: int
    shakes: int
    twists: int
    bends: int
    nod_rad: Array
    shake_rad: Array
    twist_rad: Array
    bend_rad: Array
    twist_slip: Array
    bend_slip: Array
    nod_slip: Array
    shake_slip: Array
    posture_pelvis: Array
    posture_head: Array
    bow_rad: float
    bow_share: float
    bow_twist: Array
    steps: int
    step_m: float
    walk_yaw: float
    turn_rad: float
    pivot_m: Array
    bow_first: bool
    arms_out: bool
    tempo: float

    @staticmethod
    def drawn(rng: np.random.Generator) -> "Performance":
        """Some time or other."""
        nods, shakes, twists, bends = rng.integers(1, 3, 4)
        return Performance(
            nods=int(nods),
            shakes=int(shakes),
            twists=int(twists),
            bends=int(bends),
            # who does it more often goes less far
            nod_rad=np.deg2rad(rng.uniform((15.0, 3.0), (40.0, 20.0))) / np.sqrt(nods),
            shake_rad=np.deg2rad(rng.uniform(25.0, 60.0, 2)) / np.sqrt(shakes),
            twist_rad=np.deg2rad(rng.uniform(25.0, 65.0, 2)) / np.sqrt(twists),
            bend_rad=np.deg2rad(rng.uniform(15.0, 45.0, 2)) / np.sqrt(bends),
            twist_slip=np.stack([_degrees(rng, 0.0, 1.5, 1.5) for _ in range(2)]),
            bend_slip=np.stack([_degrees(rng, 2.5, 2.5, 0.0) for _ in range(2)]),
            nod_slip=_degrees(rng, 0.0, 2.0, 2.0),
            shake_slip=_degrees(rng, 2.0, 0.0, 2.0),
            posture_pelvis=_degrees(rng, 2.0, 0.0, 1.4),
            posture_head=_degrees(rng, 2.0, 1.5, 1.5),
            bow_rad=float(np.deg2rad(rng.uniform(25.0, 75.0))),
            bow_share=float(rng.uniform(0.35, 0.75)),
            bow_twist=rng.normal(0.0, 0.06, 2),
            steps=int(rng.integers(2, 4)),
            step_m=float(rng.uniform(0.3, 0.5)),
            walk_yaw=float(_degrees(rng, 2.0)[0]),
            turn_rad=float(np.deg2rad(rng.uniform(220.0, 400.0)) * rng.choice([-1.0, 1.0])),
            pivot_m=rng.normal(0.0, 1.0, 2) * (0.008, 0.012),
            bow_first=bool(rng.random() < 0.7),
            arms_out=bool(rng.random() < 0.5),
            tempo=float(rng.uniform(0.9, 1.15)),
        )


@dataclass(frozen=True, slots=True)
class _Plan:
    """When each part begins and ends, in seconds."""

    gestures: tuple[float, float]
    lower: tuple[float, float]
    bow: tuple[float, float]
    walk: tuple[float, float]
    turn: tuple[float, float]
    end_s: float

    @staticmethod
    def of(habits: Habits, now: Performance) -> "_Plan":
        """Head and hands first, then the rest one after the other."""
        pace = 1.0 / (habits.tempo * now.tempo)
        start = 0.2 * pace if now.arms_out else 0.9 * pace
        at = start + 2.6 * pace
        lower = at - 0.1 * pace if now.arms_out else 0.0
        spans = {"gestures": (start, at), "lower": (lower, lower + 1.0 * pace)}
        at += 0.35 * pace if now.arms_out else 0.0
        walk_s = 0.6 * (now.steps + 1) * pace  # the last one only closes
        turn_s = (0.6 + abs(now.turn_rad) / np.deg2rad(360.0) * 1.9) * pace
        lengths = {"bow": 1.8 * pace, "walk": walk_s, "turn": turn_s}
        order = ("bow", "walk", "turn") if now.bow_first else ("walk", "turn", "bow")
        for name in order:
            spans[name] = (at, at + lengths[name])
            at += lengths[name] + 0.05 * pace
        return _Plan(**spans, end_s=at + 0.2)


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
    plan = _Plan.of(habits, now)
    t = np.arange(round(plan.end_s * RATE_HZ) + 1) / RATE_HZ
    place, yaw, feet = _way(habits, now, plan, t, rng)
    R = np.broadcast_to(np.eye(3), (len(t), 22, 3, 3)).copy()
    p_hips = _trunk(habits, now, plan, t, place, yaw, feet, R, rng)
    _head(habits, now, plan, t, yaw, R, rng)
    _arms(habits, now, plan, t, R, rng)
    return _standing(p_hips, feet, R)


def _ramp(t: Array, span: tuple[float, float]) -> Array:
    return minimum_jerk((t - span[0]) / (span[1] - span[0]))


def _bump(t: Array, span: tuple[float, float], hold: float = 0.2) -> Array:
    """From 0 up to 1, a while there, and down again."""
    a = (t - span[0]) / (span[1] - span[0])
    rise = 0.5 - hold / 2.0
    return minimum_jerk(a / rise) - minimum_jerk((a - rise - hold) / rise)


def _waves(t: Array, span: tuple[float, float], count: int, sides: Array) -> Array:
    """``count`` times to one side and to the other, each as far as ``sides`` (2,) says."""
    a = np.clip((t - span[0]) / (span[1] - span[0]), 0.0, 1.0)
    wave = np.sin(2.0 * np.pi * count * a) * np.minimum(1.0, 8.0 * np.minimum(a, 1.0 - a))
    return np.asarray(np.where(wave > 0.0, sides[0], sides[1]) * wave)


def _way(
    habits: Habits, now: Performance, plan: _Plan, t: Array, rng: np.random.Generator
) -> tuple[Array, Array, Feet]:
    """Place of the hips on the floor (m, 2), heading of the body (m), and the feet."""
    # a body speeds up and slows down within about a step
    walked_m = now.steps * now.step_m * _cruise(t, plan.walk)
    course = float(np.deg2rad(rng.normal(0.0, 3.0)))  # nobody walks quite where they look
    yaw = course * _ramp(t, plan.walk) + now.turn_rad * _cruise(t, plan.turn)
    direction = np.array([np.sin(course), np.cos(course)])
    turning = yaw - course * _ramp(t, plan.walk)
    pivot = habits.pivot_m + now.pivot_m
    place = walked_m[:, None] * direction
    place = place + _level(course, pivot) - _level(course + turning, pivot)
    moving = _bump(t, plan.turn, 0.6)[:, None]
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


def _cruise(t: Array, span: tuple[float, float]) -> Array:
    """From 0 to 1 at an even speed but for a quarter at either end."""
    a = np.clip((t - span[0]) / (span[1] - span[0]), 0.0, 1.0)
    e = 0.25
    start, end = minimum_jerk_integral(a / e) * e, minimum_jerk_integral((1.0 - a) / e) * e
    middle = np.clip(a, e, 1.0 - e) - e
    whole = 1.0 - e
    return np.asarray((start + middle + 0.5 * e - end) / whole)


def minimum_jerk_integral(t: Array) -> Array:
    """Way covered while the speed goes from 0 to 1 as :func:`minimum_jerk` has it; 0.5 at 1."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t**4 * (2.5 - 3.0 * t + t**2))


def _trunk(
    habits: Habits,
    now: Performance,
    plan: _Plan,
    t: Array,
    place: Array,
    yaw: Array,
    feet: Feet,
    R: Array,
    rng: np.random.Generator,
) -> Array:
    """Fill in pelvis and back; where the hips are (m, 3)."""
    bow = now.bow_rad * _bump(t, plan.bow)
    walking = _bump(t, plan.walk, 0.6)
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
    plan: _Plan,
    t: Array,
    yaw: Array,
    R: Array,
    rng: np.random.Generator,
) -> None:
    """Fill in neck and head."""
    a, b = plan.gestures
    middle = a + (b - a) * rng.uniform(0.4, 0.6)
    nod = _waves(t, (a, middle), now.nods, now.nod_rad)
    shake = _waves(t, (middle - 0.1, b), now.shakes, now.shake_rad)
    wobble = smooth_noise(rng, t, 3, np.deg2rad(1.0))
    nod_axis = from_rotation_vector(now.nod_slip) @ habits.nod_axis
    shake_axis = from_rotation_vector(now.shake_slip) @ habits.shake_axis
    posture = from_rotation_vector(now.posture_head)
    # in a bow some go on looking ahead and some look at the floor
    follow = rng.uniform(0.3, 1.0)
    level = slerp(rotation_y(yaw), R[:, Joint.UPPER_CHEST], follow * _bump(t, plan.bow, 0.5))
    # who turns looks ahead of the turn
    ahead = np.sign(now.turn_rad) * np.deg2rad(rng.uniform(5.0, 25.0)) * _bump(t, plan.turn)
    base = level @ rotation_y(ahead) @ from_rotation_vector(wobble)

    def turned(share_nod: float, share_shake: float) -> Array:
        down = from_axis_angle(normalize(nod_axis), share_nod * nod)
        return np.asarray(from_axis_angle(normalize(shake_axis), share_shake * shake) @ down)

    R[:, Joint.HEAD] = base @ turned(1.0, 1.0) @ posture
    R[:, Joint.NECK] = slerp(R[:, Joint.UPPER_CHEST], base, 0.5) @ turned(habits.neck_share, 0.3)


def _arms(
    habits: Habits,
    now: Performance,
    plan: _Plan,
    t: Array,
    R: Array,
    rng: np.random.Generator,
) -> None:
    """Fill in arms and hands: out to the sides, then hanging."""
    a, b = plan.gestures
    middle = a + (b - a) * rng.uniform(0.45, 0.6)
    together = rng.random() < 0.5  # both hands the same way round, or mirrored
    hang = _ramp(t, plan.lower)
    # a bow with arms hanging: they stay vertical
    plumb = slerp(R[:, Joint.UPPER_CHEST], heading(R[:, Joint.UPPER_CHEST]), 0.8 * hang)
    joints = (
        (Joint.LEFT_UPPER_ARM, Joint.LEFT_LOWER_ARM, Joint.LEFT_HAND),
        (Joint.RIGHT_UPPER_ARM, Joint.RIGHT_LOWER_ARM, Joint.RIGHT_HAND),
    )
    swing = np.deg2rad(12.0) * _bump(t, plan.walk) * np.sin(2.0 * np.pi * 0.9 * t)
    for i, (upper, lower, hand) in enumerate(joints):
        side = 1.0 if i == 0 else -1.0
        flip = np.array([1.0, side, side])  # a rotation vector, mirrored left and right
        late = rng.uniform(-0.1, 0.1)
        twist_wave = _waves(t - late, (a, middle), now.twists, np.full(2, now.twist_rad[i]))
        bend_wave = _waves(t - late, (middle - 0.05, b), now.bends, np.full(2, now.bend_rad[i]))
        droop = np.deg2rad(rng.normal(6.0, 5.0)) + hang * np.deg2rad(rng.uniform(68.0, 78.0))
        ahead = np.deg2rad(rng.normal(3.0, 3.0))
        # an arm gives way a little to what its hand does
        give = np.deg2rad(rng.uniform(-2.0, 3.0)) * bend_wave / now.bend_rad[i]
        moving = smooth_noise(rng, t, 3, np.deg2rad(1.2))
        droop = droop + give + moving[:, 0]
        aim = rotation_z(-side * droop) @ rotation_y(-side * (ahead + moving[:, 1]))
        R[:, upper] = plumb @ rotation_x(side * swing) @ aim
        elbow = np.deg2rad(rng.uniform(1.0, 8.0)) + hang * np.deg2rad(rng.uniform(4.0, 18.0))
        roll = np.deg2rad(rng.normal(0.0, 15.0)) * hang  # hanging hands turn inwards or outwards
        sign = 1.0 if together or i == 0 else -1.0
        twist = from_axis_angle(
            normalize(flip * (from_rotation_vector(now.twist_slip[i]) @ habits.twist_axis[i])),
            sign * twist_wave + roll,
        )
        slack = smooth_noise(rng, t, 3, np.deg2rad(1.5)) * flip
        bend = from_axis_angle(
            normalize(flip * (from_rotation_vector(now.bend_slip[i]) @ habits.bend_axis[i])),
            bend_wave,
        )
        carried = R[:, upper] @ rotation_y(-side * elbow)
        R[:, lower] = carried @ rotation_x(sign * twist_wave + roll)
        rest = from_rotation_vector(flip * _degrees(rng, 3.0, 4.0, 4.0))
        R[:, hand] = carried @ rest @ twist @ bend @ from_rotation_vector(slack)


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
