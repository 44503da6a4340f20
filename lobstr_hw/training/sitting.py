"""People who sit down on a chair and get up again, made from people who stand.

All captures together hold half a minute of sitting, which is what people do most. It can be made
without inventing much: the pelvis goes down and back along a minimum-jerk path and comes up again,
the trunk bows meanwhile, head and hands go along, and the feet stay where the capture has them; the
legs follow by inverse kinematics.
"""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.features import POINT_ROLES, reference_frames
from lobstr_hw.ik.vectors import rotate
from lobstr_hw.lower_body import pose_from_6d
from lobstr_hw.rotations import Array, rotation_x, transpose
from lobstr_hw.simulation.footsteps import minimum_jerk
from lobstr_hw.trackers import TrackerRole
from lobstr_hw.training.replaced_legs import HIPS, ankles_of, apart, can_reach, pose_to_ankles

__all__ = ["Sitting", "sat_down"]

HEAD = POINT_ROLES.index(TrackerRole.HEAD)
HANDS = [POINT_ROLES.index(r) for r in (TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND)]
GOING_M_S = 0.3
"""Who goes about faster, in the mean, does not sit."""
SEATS_M = (0.42, 0.64)
"""Heights of the hips on a chair."""
LOWEST_HAND_M = 0.15
"""Hands that hang are not lowered to the floor."""


@dataclass(frozen=True, slots=True)
class Sitting:
    """How somebody sits; angles in radians.

    Attributes:
        depth_m: by which the hips are lowered.
        back_m: by which they go back meanwhile.
        lean: of the trunk forwards while down.
        bow: further forwards half way down and up.
        pelvis: share of the trunk's lean that the pelvis has.
        slump: of the pelvis backwards while down.
        gaze: share of the trunk's lean that the head goes along with.
        splay: of the knees outwards.
        hands_m: by which the hands are raised, onto the thighs.
    """

    depth_m: float
    back_m: float
    lean: float
    bow: float
    pelvis: float
    slump: float
    gaze: float
    splay: float
    hands_m: float

    @staticmethod
    def drawn(rng: np.random.Generator, stands_m: float) -> "Sitting":
        """Of somebody whose hips are at a height."""
        depth = max(0.0, stands_m - rng.uniform(*SEATS_M))
        degrees = np.deg2rad
        return Sitting(
            depth_m=depth,
            back_m=depth * rng.uniform(0.5, 0.95),
            lean=degrees(rng.uniform(-8.0, 15.0)),
            bow=degrees(rng.uniform(10.0, 45.0)),
            pelvis=rng.uniform(0.3, 0.8),
            slump=degrees(rng.uniform(0.0, 14.0)),
            gaze=rng.uniform(0.0, 0.5),
            splay=degrees(rng.uniform(-5.0, 25.0)),
            hands_m=rng.uniform(0.0, 0.5) * depth,
        )


def sat_down(
    p: Array, R: Array, pose: Array, rate_hz: float, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """The same piece of a clip, sitting now and then; as it is where somebody goes about.

    Args:
        p: (frames, 4, 3) the points of the features, world, standard skeleton.
        R: (frames, 4, 3, 3).
        pose: (frames, 48) the truth.
        rate_hz: of the frames.
        rng: all that is drawn.

    Returns:
        p, R and pose alike; what went in where legs could not do it. Feet (and so contacts) are
        where they were.
    """
    way = np.diff(p[:, HIPS][:, [0, 2]], axis=0)
    if np.linalg.norm(way, axis=-1).mean() * rate_hz > GOING_M_S:
        return p, R, pose
    how = Sitting.drawn(rng, float(np.median(p[:, HIPS, 1])))
    share = _up_and_down(len(p), rate_hz, rng)
    new_p, new_R = _points(p, R, how, share)
    joints = pose_from_6d(pose)
    ankles = ankles_of(p, R, joints)
    if not can_reach(apart(new_p, new_R, ankles), apart(p, R, ankles)):
        return p, R, pose
    R_ref = reference_frames(R[:, HIPS])[:, None]
    return new_p, new_R, pose_to_ankles(joints, R_ref, new_p, new_R, ankles, how.splay * share)


def _up_and_down(frames: int, rate_hz: float, rng: np.random.Generator) -> Array:
    """From 0 (as captured) to 1 (down) and back, for (frames,), begun at any time."""
    t = np.arange(frames) / rate_hz
    out = np.zeros(frames)
    when = -rng.uniform(0.0, 6.0)
    while when < t[-1]:
        down_s, stays_s, up_s = rng.uniform(0.5, 1.6), rng.uniform(0.5, 7.0), rng.uniform(0.5, 1.6)
        rises = when + down_s + stays_s
        out += minimum_jerk((t - when) / down_s) - minimum_jerk((t - rises) / up_s)
        when = rises + up_s + rng.uniform(0.3, 4.0)
    return out


def _points(p: Array, R: Array, how: Sitting, share: Array) -> tuple[Array, Array]:
    R_ref = reference_frames(R[:, HIPS])
    leaning = how.lean * share + 4.0 * how.bow * share * (1.0 - share)
    down = share[:, None] * np.array([0.0, -how.depth_m, -how.back_m])
    hips = p[:, HIPS] + rotate(R_ref, down)
    turned = {
        HIPS: how.pelvis * leaning - how.slump * share,
        HEAD: how.gaze * leaning,
        **dict.fromkeys(HANDS, leaning),
    }
    trunk = _about_x(R_ref, leaning)
    new_p = hips[:, None] + rotate(trunk[:, None], p - p[:, HIPS : HIPS + 1])
    new_p[:, HANDS, 1] += (how.hands_m * share)[:, None]
    new_p[:, HANDS, 1] = np.maximum(new_p[:, HANDS, 1], np.minimum(p[:, HANDS, 1], LOWEST_HAND_M))
    new_R = np.stack([_about_x(R_ref, turned[i]) @ R[:, i] for i in range(len(turned))], axis=1)
    return new_p, new_R


def _about_x(R_ref: Array, angle: Array) -> Array:
    """Forwards by an angle (frames,), about the left of a heading (frames, 3, 3)."""
    return np.asarray(R_ref @ rotation_x(angle) @ transpose(R_ref))
