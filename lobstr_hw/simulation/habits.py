"""How people move when they are asked to: what each keeps, and what differs from time to time.

What is assumed about people, and where it comes from, stands in docs/calibration.md.
"""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.rotations import Array, from_rotation_vector

__all__ = ["Habits", "Performance", "degrees_off"]


def degrees_off(rng: np.random.Generator, *deviations: float) -> Array:
    """Normal, of these deviations in degrees; radians."""
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
        nod, shake = degrees_off(rng, 0.0, 2.0, 2.0), degrees_off(rng, 4.0, 0.0, 2.5)
        twist = np.stack([degrees_off(rng, 0.0, 4.0, 4.0) for _ in range(2)])
        bend = np.stack([degrees_off(rng, 5.0, 5.0, 0.0) for _ in range(2)])
        return Habits(
            nod_axis=from_rotation_vector(nod)[:, 0],
            shake_axis=from_rotation_vector(shake)[:, 1],
            twist_axis=from_rotation_vector(twist)[..., 0],
            bend_axis=from_rotation_vector(bend)[..., 2],
            neck_share=float(rng.uniform(0.15, 0.5)),
            walking=np.deg2rad([1.0, 0.0]) + degrees_off(rng, 1.0, 1.5),
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
            twist_slip=np.stack([degrees_off(rng, 0.0, 1.5, 1.5) for _ in range(2)]),
            bend_slip=np.stack([degrees_off(rng, 2.5, 2.5, 0.0) for _ in range(2)]),
            nod_slip=degrees_off(rng, 0.0, 2.0, 2.0),
            shake_slip=degrees_off(rng, 2.0, 0.0, 2.0),
            posture_pelvis=degrees_off(rng, 2.0, 0.0, 1.4),
            posture_head=degrees_off(rng, 2.0, 1.5, 1.5),
            bow_rad=float(np.deg2rad(rng.uniform(25.0, 75.0))),
            bow_share=float(rng.uniform(0.35, 0.75)),
            bow_twist=rng.normal(0.0, 0.06, 2),
            steps=int(rng.integers(2, 4)),
            step_m=float(rng.uniform(0.3, 0.5)),
            walk_yaw=float(degrees_off(rng, 2.0)[0]),
            turn_rad=float(np.deg2rad(rng.uniform(220.0, 400.0)) * rng.choice([-1.0, 1.0])),
            pivot_m=rng.normal(0.0, 1.0, 2) * (0.008, 0.012),
            bow_first=bool(rng.random() < 0.7),
            arms_out=bool(rng.random() < 0.5),
            tempo=float(rng.uniform(0.9, 1.15)),
        )
