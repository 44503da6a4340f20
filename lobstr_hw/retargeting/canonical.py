"""Joint frames that mean the same on every rig, fitted from the motion (docs/retargeting.md).

A rig's zero pose is its maker's choice: legs splayed, bones along X, the pelvis pitched by 20
degrees. So the frames are told from how a person moves. For each joint a constant turn A takes the
rig's frame to the standard skeleton's: ``R_world_canonical = R_world_rig @ A``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.retargeting.evidence import (
    LEAST_WALK_S,
    RATE_HZ,
    Bools,
    Evidence,
    gather,
    trunk_line,
)
from lobstr_hw.retargeting.source import LEGS, SourceClip
from lobstr_hw.rotations import (
    Array,
    geodesic_angle,
    heading,
    normalize,
    rotation_between,
    rotation_mean,
    slerp,
    transpose,
)
from lobstr_hw.skeleton import PARENTS, STANDARD_OFFSETS, Joint

__all__ = ["CanonicalFrames", "canonical_rotations", "fit_frames"]

_UP = np.array([0.0, 1.0, 0.0])
_TRUNK = (Joint.SPINE, Joint.CHEST, Joint.UPPER_CHEST, Joint.NECK, Joint.HEAD)
_ARMS = (
    (Joint.LEFT_SHOULDER, Joint.LEFT_UPPER_ARM, Joint.LEFT_LOWER_ARM, Joint.LEFT_HAND),
    (Joint.RIGHT_SHOULDER, Joint.RIGHT_UPPER_ARM, Joint.RIGHT_LOWER_ARM, Joint.RIGHT_HAND),
)
_BENT = np.radians(25.0)
_LEAST_FLAT = 8  # frames
_ANKLE_DROP = -float(STANDARD_OFFSETS[Joint.LEFT_TOES, 1])


@dataclass(frozen=True, slots=True, eq=False)
class CanonicalFrames:
    """What was fitted for one subject on one rig.

    Attributes:
        A: (22, 3, 3) rig frame to canonical frame.
        lift: metres (standard size) to raise the hips by, because the rig's ankle stands higher or
            lower over its toe base than the standard's.
        mapped: the joints that the rig has.
        notes: where there was too little to fit from, and what was done instead.
    """

    A: Array
    lift: float
    mapped: tuple[Joint, ...]
    notes: tuple[str, ...] = ()


def fit_frames(
    clips: Sequence[SourceClip], others: CanonicalFrames | None = None
) -> CanonicalFrames:
    """Fit the canonical frames of one subject on one rig.

    Args:
        clips: of this subject, all on the same rig.
        others: fitted from everybody on this rig: stands in, before the zero pose, for what these
            clips show too little of.
    """
    mapped = clips[0].mapped
    if all(clip.standard for clip in clips):
        return CanonicalFrames(np.tile(np.eye(3), (22, 1, 1)), 0.0, mapped)
    return _Fit(gather(clips), clips[0], others).frames()


class _Fit:
    """The steps of one fit; each joint's frame may use the ones before it."""

    def __init__(
        self, evidence: Evidence, clip: SourceClip, others: CanonicalFrames | None
    ) -> None:
        self.e = evidence
        self.others = others
        self.rest = clip.p_rest
        self.mapped = clip.mapped
        self.A = np.tile(np.eye(3), (22, 1, 1))
        self.notes: list[str] = list(evidence.notes)

    def frames(self) -> CanonicalFrames:
        self._hips()
        self._trunk()
        for side in (0, 1):
            self._leg(side)
            self._arm(side)
        return CanonicalFrames(self.A, self._lift(), self.mapped, tuple(self.notes))

    def _instead(self, *joints: Joint) -> bool:
        """Take these frames from everybody on this rig; False where there is nobody else."""
        if self.others is None:
            return False
        for joint in joints:
            self.A[joint] = self.others.A[joint]
        return True

    def _canonical(self, joint: int) -> Array:
        return np.asarray(self.e.R[:, joint] @ self.A[joint])

    def _inside(self, joint: int, v: Array) -> Array:
        """World vectors in a joint's own frame."""
        return np.asarray((transpose(self.e.R[:, joint]) @ v[..., None])[..., 0])

    def _hips(self) -> None:
        if self.e.walking_s < LEAST_WALK_S and self._instead(Joint.HIPS):
            return
        line = self.e.p[:, Joint.LEFT_UPPER_LEG] - self.e.p[:, Joint.RIGHT_UPPER_LEG]
        x = _direction(self._inside(Joint.HIPS, line))
        if self.e.upright.any():
            up = _direction(
                self._inside(Joint.HIPS, np.broadcast_to(_UP, line.shape))[self.e.upright]
            )
        else:
            up = self.rest[Joint.UPPER_CHEST] - self.rest[Joint.HIPS]
        self.A[Joint.HIPS] = _frame(x=x, y=up)

    def _trunk(self) -> None:
        if self.e.walking_s < LEAST_WALK_S and self._instead(*_TRUNK):
            return
        ahead = heading(self._canonical(Joint.HIPS))
        # a player walks with the back bent forward and the eyes level: the line from hips to
        # shoulders says how far the chest leans, and is upright on the standard skeleton
        leaning = rotation_between(_UP, trunk_line(self.e.p)) @ ahead
        target = dict.fromkeys(_TRUNK, leaning)
        target |= {Joint.HEAD: ahead, Joint.NECK: slerp(leaning, ahead, 0.5)}
        for joint in _TRUNK:
            if joint in self.mapped:
                self._follow(joint, target[joint], self.e.upright, Joint.HIPS)

    def _follow(self, joint: Joint, target: Array, when: Bools, like: Joint) -> None:
        """On average the target's frame while ``when``; else the zero pose of ``like``."""
        if when.any():
            self.A[joint] = _robust_mean(transpose(self.e.R[when, joint]) @ target[when])
        else:
            self.A[joint] = self.A[like]

    def _leg(self, side: int) -> None:
        upper, lower, foot, toes = LEGS[side]
        thigh = self.e.p[:, lower] - self.e.p[:, upper]
        shin = self.e.p[:, foot] - self.e.p[:, lower]
        hinge = self._hinge(thigh, shin, f"{upper.name} knee")
        if hinge is not None or not self._instead(upper, lower):
            axis = self._canonical(Joint.HIPS)[:, :, 0] if hinge is None else hinge
            self.A[upper] = self._along(upper, -thigh, axis)
            self.A[lower] = self._along(lower, -shin, axis)
        self._foot(foot, toes, side)

    def _foot(self, foot: Joint, toes: Joint, side: int) -> None:
        flat = self.e.flat[:, side]
        bone = _direction(self._inside(foot, self.e.p[:, toes] - self.e.p[:, foot]))
        if flat.sum() >= _LEAST_FLAT:
            self.A[foot] = self._foot_frame(foot, bone, flat)
        else:
            self.notes.append(f"{foot.name}: {flat.sum() / RATE_HZ:.1f} s of flat stance")
            if self._instead(foot, toes):
                return
            flat = self.e.low[:, side] if self.e.low[:, side].any() else np.ones_like(flat)
            self.A[foot] = self._foot_frame(foot, bone, flat)
        self._follow(toes, self._canonical(foot), flat, foot)

    def _foot_frame(self, foot: Joint, bone: Array, flat: Bools) -> Array:
        up = self._inside(foot, np.broadcast_to(_UP, (len(flat), 3)))[flat]
        return _frame(y=_direction(up), z=bone, first="y")

    def _hinge(self, upper: Array, lower: Array, name: str) -> Array | None:
        """World axis (F, 3) of a hinge; NaN in frames that do not show it; None if none does."""
        cross = np.cross(upper, lower)
        sine = np.linalg.norm(cross, axis=-1)
        bend = np.arctan2(sine, np.sum(upper * lower, axis=-1))
        bent = bend > _BENT
        if bent.sum() < RATE_HZ:
            self.notes.append(f"{name}: bent for {bent.sum() / RATE_HZ:.1f} s")
            return None
        return np.where(bent[:, None], normalize(cross), np.nan)

    def _along(self, joint: Joint, y: Array, x: Array) -> Array:
        """Y along the bone, X the hinge's axis, both as the joint's own frame has them."""
        return _frame(
            y=_direction(self._inside(joint, y)), x=_direction(self._inside(joint, x)), first="y"
        )

    def _arm(self, side: int) -> None:
        shoulder, upper, lower, hand = _ARMS[side]
        out = 1.0 - 2.0 * side  # the left arm's bone is along +X, the right's along -X
        arm = self.e.p[:, lower] - self.e.p[:, upper]
        forearm = self.e.p[:, hand] - self.e.p[:, lower]
        chest = self._canonical(Joint.UPPER_CHEST)
        # arms hang: an elbow's axis points to the side then, and up in the T-pose
        hinge = self._hinge(out * forearm, arm, f"{upper.name} elbow")
        if hinge is not None or not self._instead(upper, lower):
            axis = out * chest[:, :, 0] if hinge is None else hinge
            for joint, bone in ((upper, arm), (lower, forearm)):
                x = _direction(self._inside(joint, out * bone))
                y = _direction(self._inside(joint, axis))
                self.A[joint] = _frame(x=x, y=y)
        if self.e.walking_s < LEAST_WALK_S and self._instead(hand, shoulder):
            return
        self._follow(hand, self._canonical(lower), self.e.upright, lower)
        if shoulder in self.mapped:
            self._follow(shoulder, chest, self.e.upright, Joint.UPPER_CHEST)

    def _lift(self) -> float:
        drops = [
            (self.e.p[:, foot, 1] - self.e.p[:, toes, 1])[self.e.flat[:, side]]
            for side, (_, _, foot, toes) in enumerate(LEGS)
        ]
        both = np.concatenate(drops)
        if len(both) < _LEAST_FLAT:
            return self.others.lift if self.others else 0.0
        return _ANKLE_DROP - float(np.median(both))


def _robust_mean(R: Array) -> Array:
    """The mean (3, 3) of rotations (F, 3, 3) of which a few may be flipped."""
    mean = rotation_mean(R)
    for limit in (90.0, 45.0):
        near = geodesic_angle(R, mean) < np.radians(limit)
        mean = rotation_mean(R[near]) if near.any() else mean
    return mean


def _direction(v: Array) -> Array:
    """The median direction (3,) of vectors (F, 3), NaN left out."""
    return normalize(np.nanmedian(v, axis=0))


def _frame(
    x: Array | None = None, y: Array | None = None, z: Array | None = None, first: str = "x"
) -> Array:
    """A rotation from two of its axes; ``first`` is kept, the other made orthogonal to it."""
    axes = {name: v for name, v in zip("xyz", (x, y, z), strict=True) if v is not None}
    (second,) = set(axes) - {first}
    a = normalize(axes[first])
    b = normalize(axes[second] - (axes[second] @ a) * a)
    columns = {first: a, second: b}
    third = ({"x", "y", "z"} - set(columns)).pop()
    i = "xyz".index(third)
    columns[third] = np.cross(columns["xyz"[(i + 1) % 3]], columns["xyz"[(i + 2) % 3]])
    return np.stack([columns[n] for n in "xyz"], axis=-1)


def canonical_rotations(clip: SourceClip, frames: CanonicalFrames) -> Array:
    """World rotations (F, 22, 3, 3) of the standard skeleton's joints.

    Joints that the rig lacks: a clavicle follows the chest; the others stand half-way between their
    neighbours.
    """
    R = clip.R @ frames.A
    for joint in (j for j in Joint if j not in frames.mapped):
        parent = R[:, PARENTS[joint]]
        child = _next_mapped(joint, frames.mapped)
        turn = joint in _TRUNK and child is not None
        R[:, joint] = _halfway(parent, R[:, child]) if turn and child is not None else parent
    return np.asarray(R)


def _next_mapped(joint: Joint, mapped: tuple[Joint, ...]) -> int | None:
    later = [j for j in _TRUNK if j > joint and j in mapped]
    return int(later[0]) if later else None


def _halfway(A: Array, B: Array) -> Array:
    """The mean of two rotations; the nearest matrix to their sum is the half of the turn."""
    return rotation_mean(np.stack([A, B]))
