"""What the network sees: velocities of four points in the pelvis' heading, and the hips' height.

One definition, called by training (windows of clips) and by the runtime (one step). Version 1:

    v     = R_ref^T (p_i - p_{i-1})             metres per grid step
    omega = R_ref^T (R_i R_{i-1}^T) R_ref       as 6D
    x_i   = [v, omega] x 4, then the height of the hips above the floor    -> 37

omega depends neither on the heading nor on how a device is mounted. The other forms are kept for
tables: ``paper`` is what Yang et al. 2021 print in appendix 1; ``position`` (section 4.1.3) has the
pelvis' velocity as printed, but place and rotation of the other points in the reference frame;
``combined`` has both, 64 numbers. They are scaled as the paper does it: nothing but the height.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lobstr_hw.rotations import HEADING_MINIMUM, Array, heading_angle, rotation_y, to_6d, transpose
from lobstr_hw.skeleton import Joint
from lobstr_hw.trackers import ROLE_JOINT, TrackerRole

__all__ = [
    "FEATURE_VERSION",
    "INPUT_SIZE",
    "POINT_JOINTS",
    "POINT_ROLES",
    "Form",
    "Points",
    "clip_features",
    "clip_points",
    "features",
    "input_size",
    "mirror_features",
    "reference_frame",
    "reference_frames",
]

FEATURE_VERSION = 1
"""Frozen with the skeleton: another version means other weights."""

Form = Literal["v1", "paper", "position", "combined"]
Bools = npt.NDArray[np.bool_]

POINT_ROLES = (
    TrackerRole.PELVIS,
    TrackerRole.HEAD,
    TrackerRole.LEFT_HAND,
    TrackerRole.RIGHT_HAND,
)
"""The points in the order of the input."""

POINT_JOINTS: tuple[Joint, ...] = tuple(ROLE_JOINT[role] for role in POINT_ROLES)
INPUT_SIZE = 9 * len(POINT_ROLES) + 1
_MIRRORED_ROWS = (0, 1, 3, 2, 4, 6, 5)
"""Of the four velocities, then of the places of head and hands where a form has both."""
_IDENTITY_6D = to_6d(np.eye(3))


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """The four points at one grid time, or at many (any leading axes).

    Attributes:
        p: (..., 4, 3) in the world, metres on the standard skeleton.
        R: (..., 4, 3, 3) in the world.
        valid_p: (..., 4) which positions were measured.
        valid_R: (..., 4) which rotations were measured.
        R_ref: (..., 3, 3) the reference frame.
    """

    p: Array
    R: Array
    valid_p: Bools
    valid_R: Bools
    R_ref: Array

    def take(self, index: Any) -> "Points":
        """The points at an index of the first axis."""
        return Points(
            self.p[index],
            self.R[index],
            self.valid_p[index],
            self.valid_R[index],
            self.R_ref[index],
        )


def input_size(form: Form) -> int:
    """Numbers of the input in a form."""
    return INPUT_SIZE + 9 * (len(POINT_ROLES) - 1) if form == "combined" else INPUT_SIZE


def reference_frame(
    R_hips: Array, last: Array | None = None, keep: Bools | None = None, form: Form = "v1"
) -> Array:
    """The turn about the vertical that the pelvis faces.

    Args:
        R_hips: (..., 3, 3) in the world.
        last: (..., 3, 3) the reference frame of the step before.
        keep: (...) where ``last`` means something and is kept while the pelvis has no heading.
        form: all but ``v1`` project the pelvis' Z on the floor; it flips when bowing beyond 90
            degrees.
    """
    yaw, certainty = _yaw(R_hips, form)
    R_ref = rotation_y(yaw)
    if last is None or keep is None:
        return R_ref
    return np.where(((certainty < HEADING_MINIMUM) & keep)[..., None, None], last, R_ref)


def reference_frames(R_hips: Array, form: Form = "v1", first: Array | None = None) -> Array:
    """:func:`reference_frame` step by step along the first axis (frames, ..., 3, 3).

    Args:
        R_hips: (frames, ..., 3, 3) in the world.
        form: as there.
        first: (..., 3, 3) for the first frame and on until the pelvis has a heading, if it has none
            there; None takes what there is.
    """
    yaw, certainty = _yaw(R_hips, form)
    good = certainty >= HEADING_MINIMUM
    frame = np.arange(len(yaw)).reshape(-1, *(1,) * (yaw.ndim - 1))
    last_good = np.maximum.accumulate(np.where(good, frame, 0), axis=0)
    R_ref = rotation_y(np.take_along_axis(yaw, last_good, axis=0))
    if first is None:
        return R_ref
    unknown = ~np.logical_or.accumulate(good, axis=0)
    return np.where(unknown[..., None, None], first, R_ref)


def _yaw(R_hips: Array, form: Form) -> tuple[Array, Array]:
    if form == "v1":
        return heading_angle(R_hips)
    forward_x, forward_z = R_hips[..., 0, 2], R_hips[..., 2, 2]
    return np.arctan2(forward_x, forward_z), np.hypot(forward_x, forward_z)


def features(
    before: Points,
    now: Points,
    linked: Bools,
    form: Form = "v1",
    scale: Array | float = 1.0,
) -> Array:
    """The network's input of one step (..., 37 or what :func:`input_size` says).

    Args:
        before: the points one grid step ago.
        now: the points now.
        linked: (...) whether ``before`` is one step ago; False in the first frame and after a gap.
        form: see the top of the page.
        scale: (...) the user's scale s; for all but ``v1``, which scale nothing but the height.
    """
    if form == "v1":
        v, omega = _world_deltas(before, now)
    else:
        v, omega = _printed_deltas(before, now)
        v = v / np.asarray(scale)[..., None, None]
    same_p = (before.valid_p == now.valid_p) & linked[..., None]
    same_R = (before.valid_R == now.valid_R) & linked[..., None]
    v = np.where(same_p[..., None], v, 0.0)
    omega_6d = np.where(same_R[..., None], to_6d(omega), _IDENTITY_6D)
    rows = np.concatenate([v, omega_6d], axis=-1)  # (..., 4, 9)
    if form in ("position", "combined"):
        kept = rows if form == "combined" else rows[..., :1, :]
        rows = np.concatenate([kept, _places(now, scale)], axis=-2)
    height = now.p[..., 0, 1:2]
    return np.concatenate([_flat(rows), height], axis=-1)


def _flat(rows: Array) -> Array:
    return rows.reshape(*rows.shape[:-2], 9 * rows.shape[-2])


def _places(now: Points, scale: Array | float) -> Array:
    """Place and rotation (..., 3, 9) of head and hands in the reference frame."""
    p, R = _in_reference(now)
    p = p / np.asarray(scale)[..., None, None]
    return np.concatenate([p, to_6d(R)], axis=-1)[..., 1:, :]


def _world_deltas(before: Points, now: Points) -> tuple[Array, Array]:
    R_ref = now.R_ref[..., None, :, :]
    to_ref = transpose(R_ref)
    v = (to_ref @ (now.p - before.p)[..., None])[..., 0]
    return v, to_ref @ (now.R @ transpose(before.R)) @ R_ref


def _printed_deltas(before: Points, now: Points) -> tuple[Array, Array]:
    """Appendix 1 of the paper, as printed."""
    p_before, R_before = _in_reference(before)
    p_now, R_now = _in_reference(now)
    v = p_now - p_before
    omega = transpose(R_before) @ R_now
    to_ref = transpose(now.R_ref)
    v[..., 0, :] = (to_ref @ (now.p - before.p)[..., 0, :, None])[..., 0]
    omega[..., 0, :, :] = to_ref @ transpose(before.R_ref) @ now.R_ref
    return v, omega


def _in_reference(points: Points) -> tuple[Array, Array]:
    to_ref = transpose(points.R_ref)[..., None, :, :]
    p = (to_ref @ (points.p - points.p[..., :1, :])[..., None])[..., 0]
    return p, to_ref @ points.R


def clip_points(
    p: Array,
    R: Array,
    valid_p: Bools | None = None,
    valid_R: Bools | None = None,
    form: Form = "v1",
) -> Points:
    """The points of a clip, frames first: p (frames, ..., 4, 3), R (frames, ..., 4, 3, 3)."""
    everywhere = np.ones(p.shape[:-1], dtype=bool)
    return Points(
        p,
        R,
        everywhere if valid_p is None else valid_p,
        everywhere if valid_R is None else valid_R,
        reference_frames(R[..., 0, :, :], form),
    )


def clip_features(points: Points, form: Form = "v1", scale: Array | float = 1.0) -> Array:
    """:func:`features` of each frame of a clip: (frames, ..., 37 or more)."""
    frame = np.arange(len(points.p))
    linked = np.broadcast_to(
        (frame > 0).reshape(-1, *(1,) * (points.p.ndim - 3)), points.p.shape[:-2]
    )
    return features(points.take(np.maximum(frame - 1, 0)), points, linked, form, scale)


def mirror_features(x: Array) -> Array:
    """The input (of any form) of the same motion with left and right exchanged."""
    order = _MIRRORED_ROWS[: x.shape[-1] // 9]
    rows = x[..., :-1].reshape(*x.shape[:-1], len(order), 9)[..., order, :].copy()
    rows[..., ::3] *= -1.0  # the x of v (or p), of the Z axis and of the Y axis
    return np.concatenate([_flat(rows), x[..., -1:]], axis=-1)
