"""A clip as its rig has it: the 22 joints picked, standard size, frames not fitted yet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.bvh import Bvh, read_bvh, read_skeleton
from lobstr_hw.retargeting.clips import ClipFile
from lobstr_hw.retargeting.floor import floor_tilt
from lobstr_hw.retargeting.rigs import is_standard, match_rig
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

__all__ = ["LEGS", "SourceClip", "load_source", "same_rig"]

LEGS = (
    (Joint.LEFT_UPPER_LEG, Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT, Joint.LEFT_TOES),
    (Joint.RIGHT_UPPER_LEG, Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT, Joint.RIGHT_TOES),
)
LEG_LENGTH = -float(
    STANDARD_OFFSETS[Joint.LEFT_LOWER_LEG, 1] + STANDARD_OFFSETS[Joint.LEFT_FOOT, 1]
)
_SAME_SHAPE = 0.02
_UNITS_M = (1.0, 0.01, 0.0254, 0.0254 / 0.45, 0.001)


@dataclass(frozen=True, slots=True, eq=False)
class SourceClip:
    """A clip on its own rig.

    Attributes:
        p: (F, 22, 3) joint positions in the world, times ``scale``; NaN where the rig has no joint.
        R: (F, 22, 3, 3) the rig's own joint frames in the world; NaN likewise.
        R_rest: (22, 3, 3) the joint frames of the zero pose (identity), for rigs without motion.
        p_rest: (22, 3) joint positions of the zero pose, scaled.
        mapped: the joints that the rig has.
        rate_hz: of the frames.
        scale: standard metres per unit of the file.
        metres: what 1.0 m of the standard skeleton is on the person.
        standard: the rig is this project's own.
        unit_told: whether the unit was known, not guessed.
    """

    p: Array
    R: Array
    p_rest: Array
    mapped: tuple[Joint, ...]
    rate_hz: float
    scale: float
    metres: float
    standard: bool
    unit_told: bool

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.p)

    def hip_centre(self) -> Array:
        """Midway between the hip joints (F, 3)."""
        return np.asarray(
            0.5 * (self.p[:, Joint.LEFT_UPPER_LEG] + self.p[:, Joint.RIGHT_UPPER_LEG])
        )


def load_source(clip: ClipFile) -> SourceClip:
    """Read a clip and name its joints.

    Raises:
        MotionFileError: the file cannot be read.
        UnknownRig: its joints have no table.
    """
    bvh = read_bvh(clip.path)
    _, found = match_rig(bvh.names, str(clip.path))
    columns = [int(j) for j in found]
    at = list(found.values())
    p_all, R_all = bvh.world()
    p = np.full((len(bvh), 22, 3), np.nan)
    R = np.full((len(bvh), 22, 3, 3), np.nan)
    p[:, columns], R[:, columns] = p_all[:, at], R_all[:, at]
    p_rest = np.full((22, 3), np.nan)
    p_rest[columns] = _rest(bvh)[at]
    leg = _leg_length(p)
    standard = is_standard(bvh.names)
    if not standard:
        level = floor_tilt(
            p[:, [leg_[3] for leg_ in LEGS]] * LEG_LENGTH / leg, 1.0 / bvh.frame_time_s
        )
        p, R = p @ level.T, level @ R
    unit = clip.metres_per_unit or min(_UNITS_M, key=lambda u: abs(np.log(u * leg / 0.82)))
    scale = LEG_LENGTH / leg
    return SourceClip(
        p * scale,
        R,
        p_rest * scale,
        tuple(sorted(found)),
        1.0 / bvh.frame_time_s,
        scale,
        unit / scale,
        standard,
        clip.metres_per_unit is not None,
    )


def _rest(bvh: Bvh) -> Array:
    p = np.array(bvh.offsets)
    for joint, parent in enumerate(bvh.parents):
        if parent >= 0:
            p[joint] += p[parent]
    return p


def _leg_length(p: Array) -> float:
    """Thigh and shin, mean of both sides, in the file's unit."""
    parts = [
        np.median(np.linalg.norm(p[:, leg[i]] - p[:, leg[i + 1]], axis=-1))
        for leg in LEGS
        for i in (0, 1)
    ]
    return float(np.sum(parts) / 2.0)


def same_rig(clips: Sequence[ClipFile]) -> list[list[ClipFile]]:
    """Clips of one set in lists of one rig each: the same joints, bones alike but for the unit."""
    rigs: list[tuple[str, tuple[str, ...], Array, list[ClipFile]]] = []
    for clip in clips:
        names, offsets = read_skeleton(clip.path)
        shape = offsets / max(float(np.linalg.norm(offsets)), 1e-9)
        for set_name, known, known_shape, members in rigs:
            alike = set_name == clip.set_name and known == names
            if alike and np.abs(shape - known_shape).max() < _SAME_SHAPE:
                members.append(clip)
                break
        else:
            rigs.append((clip.set_name, names, shape, [clip]))
    return [members for _, _, _, members in rigs]
