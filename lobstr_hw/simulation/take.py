"""A recording that never was: a motion, worn by a simulated user, as trackers would report it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, rotation_y, slerp
from lobstr_hw.simulation.t_pose import PoseDeviation, Sway, t_pose_motion
from lobstr_hw.simulation.tracking_errors import TrackingErrors, disturbed
from lobstr_hw.simulation.transitions import joined
from lobstr_hw.simulation.users import SimulatedUser, drawn_body, drawn_mounts
from lobstr_hw.skeleton import Body, forward_kinematics
from lobstr_hw.trackers import (
    FOUR_POINTS,
    ROLE_JOINT,
    TrackerRole,
    TrackerSample,
    TrackingState,
)

__all__ = ["SimulatedTake", "drawn_user", "simulate", "take_samples"]

T_POSE_S = 3.0
_JOINTS = [ROLE_JOINT[role] for role in FOUR_POINTS]


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedTake:
    """Trackers and truth of one take; everything in the tracking space and the user's metres.

    Attributes:
        user: who wears the trackers.
        serials: of each role's tracker.
        times_s: (m,) of the samples, from 0.
        p: (m, 4, 3) tracker positions in the order of FOUR_POINTS.
        R: (m, 4, 3, 3) tracker rotations.
        tracked: (m, 4) whether the device sees itself.
        t_pose_s: when the T-pose begins and ends.
        truth_times_s: (f,) at the motion's own rate.
        truth_p: (f, 22, 3) true joints.
        truth_R: (f, 22, 3, 3) true rotations, in the world.
    """

    user: SimulatedUser
    serials: Mapping[TrackerRole, str]
    times_s: Array
    p: Array
    R: Array
    tracked: Bools
    t_pose_s: tuple[float, float]
    truth_times_s: Array
    truth_p: Array
    truth_R: Array


def drawn_user(
    seed: int,
    height_cm: float | None = None,
    *,
    mount_seed: int | None = None,
    body: Body | None = None,
    mounts: Mapping[TrackerRole, Pose] | None = None,
    heading_rad: float | None = None,
    origin: Array | None = None,
) -> SimulatedUser:
    """Someone who is the same for the same seed.

    Args:
        seed: of body, mounts, play space and serials.
        height_cm: stature; drawn from 150 to 195 cm where None.
        mount_seed: another seed for mounts and play space only: the same person, strapped anew.
        body: instead of a drawn one.
        mounts: T_joint_tracker instead of drawn ones.
        heading_rad: of the play space in the tracking space instead of a drawn one.
        origin: (3,) of the play space instead of a drawn one.
    """
    strapping = seed if mount_seed is None else mount_seed
    stature, own = drawn_body(
        np.random.default_rng([seed, 0]), None if height_cm is None else height_cm / 100.0
    )
    worn = drawn_mounts(np.random.default_rng([strapping, 1]), stature)
    place = np.random.default_rng([strapping, 2])
    yaw, x, z = place.uniform(-np.pi, np.pi), *place.uniform(-1.0, 1.0, 2)
    names = np.random.default_rng([seed, 3]).integers(16**8, size=len(FOUR_POINTS))
    return SimulatedUser(
        stature,
        own if body is None else body,
        worn if mounts is None else mounts,
        Pose(
            rotation_y(yaw if heading_rad is None else heading_rad),
            np.array([x, 0.0, z]) if origin is None else origin,
        ),
        {role: f"LHR-{name:08X}" for role, name in zip(FOUR_POINTS, names, strict=True)},
    )


def simulate(
    motion: Motion,
    seed: int,
    height_cm: float | None = None,
    rate_hz: float = 90.0,
    *,
    user: SimulatedUser | None = None,
    mount_seed: int | None = None,
    errors: TrackingErrors | None = None,
    pose_deviation_deg: float = 10.0,
    sway: Sway | None = None,
    t_pose_s: float = T_POSE_S,
    t_pose: Motion | None = None,
) -> SimulatedTake:
    """Strap trackers on someone who does a T-pose and then this motion.

    Body, T-pose and tracking errors follow ``seed``; so do mounts and play space unless
    ``mount_seed`` is given. All are drawn from streams of their own, so changing one of them leaves
    the others as they are.

    Args:
        motion: on the standard skeleton; the T-pose is put before it, with a step in between.
        seed: of everything random.
        height_cm: stature of the user; drawn where None.
        rate_hz: of the samples.
        user: someone made elsewhere (:func:`drawn_user`) instead of a drawn one.
        mount_seed: straps and places the same person anew.
        errors: of the tracking system; a Lighthouse's where None.
        pose_deviation_deg: the most that a segment stands off the ideal T-pose.
        sway: of the T-pose; a person's where None.
        t_pose_s: how long the T-pose is held; 0 leaves it out.
        t_pose: this one instead of a drawn one, at the motion's rate.
    """
    who = drawn_user(seed, height_cm, mount_seed=mount_seed) if user is None else user
    whole = motion
    if t_pose is not None:
        t_pose_s = t_pose.duration_s
        whole = joined([t_pose, motion])
    elif t_pose_s > 0.0:
        rng = np.random.default_rng([seed, 4])
        deviation = PoseDeviation.drawn(rng, np.deg2rad(pose_deviation_deg))
        drawn = t_pose_motion(t_pose_s, motion.rate_hz, deviation, sway or Sway(), rng)
        whole = joined([drawn, motion])
    truth_p, truth_R = _worn(whole, who)
    times = np.arange(int(whole.duration_s * rate_hz + 1e-9) + 1) / rate_hz
    p, R = _sampled(truth_p[:, _JOINTS], truth_R[:, _JOINTS], times * whole.rate_hz)
    p, R = _strapped(who, p, R)
    p, R, tracked = disturbed(
        errors or TrackingErrors(), np.random.default_rng([seed, 5]), times, p, R
    )
    truth_times = np.arange(len(whole)) / whole.rate_hz
    held = (0.0, t_pose_s)
    return SimulatedTake(
        who, who.serials, times, p, R, tracked, held, truth_times, truth_p, truth_R
    )


def take_samples(take: SimulatedTake) -> Iterator[TrackerSample]:
    """The samples of a take, oldest first."""
    serials = [take.serials[role] for role in FOUR_POINTS]
    for i, time_s in enumerate(take.times_s):
        for k, serial in enumerate(serials):
            tracked = bool(take.tracked[i, k])
            state = TrackingState.OK if tracked else TrackingState.OCCLUDED
            pose = PartialPose(take.R[i, k], take.p[i, k])
            yield TrackerSample(serial, pose, float(time_s), tracked, state)


def _worn(motion: Motion, user: SimulatedUser) -> tuple[Array, Array]:
    """Joints (f, 22, 3) and rotations of the motion on the user's body, in the tracking space.

    The legs are the standard ones times the height of the hips; scaled by it, a foot that stands
    on the floor still does. Trunk and arms have their own lengths and follow the rotations.
    """
    place = user.T_tracking_play
    size = 1.0 / user.body.scale[0]
    p, R = forward_kinematics(motion.R_local, motion.p_hips * size, user.body.offsets[0])
    return place.apply(p), place.R @ R


def _sampled(p: Array, R: Array, at: Array) -> tuple[Array, Array]:
    """Poses (f, k, ...) at fractional frames ``at``: cubic in position, slerp in rotation."""
    last = len(p) - 1
    i = np.minimum(at.astype(int), last)
    before, j, after = (np.clip(i + k, 0, last) for k in (-1, 1, 2))
    f = at - i
    t = f[:, None, None]
    # Catmull-Rom: the speed at a frame is that of the line through its neighbours
    a, b, c, d = p[before], p[i], p[j], p[after]
    cubic = b + 0.5 * t * (
        c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a))
    )
    return cubic, slerp(R[i], R[j], f[:, None])


def _strapped(user: SimulatedUser, p: Array, R: Array) -> tuple[Array, Array]:
    """Joint poses (m, 4, ...) -> poses of the trackers mounted on them."""
    mounts = [user.mounts[role] for role in FOUR_POINTS]
    levers = np.stack([mount.p for mount in mounts])
    return p + (R @ levers[..., None])[..., 0], R @ np.stack([mount.R for mount in mounts])
