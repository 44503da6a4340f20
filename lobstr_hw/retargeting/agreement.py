"""Do the sets agree after retargeting? One gait must give the same angles (docs/retargeting.md).

python -m lobstr_hw.retargeting.agreement FOLDER...
"""

import argparse
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from lobstr_hw.errors import LobstrError
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting.clips import find_clips
from lobstr_hw.retargeting.retarget import retarget
from lobstr_hw.retargeting.speed import speed
from lobstr_hw.rotations import Array, heading, transpose
from lobstr_hw.skeleton import Joint

__all__ = ["Agreement", "Gait", "measure", "walking_frames"]

_LEGS = (
    (Joint.LEFT_UPPER_LEG, Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT, Joint.LEFT_TOES),
    (Joint.RIGHT_UPPER_LEG, Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT, Joint.RIGHT_TOES),
)


@dataclass(frozen=True, slots=True)
class Gait:
    """Angles in degrees, lengths in cm of the standard size, while walking forward upright.

    Attributes:
        walking_s: how long that was.
        pelvis_pitch: mean forward tilt.
        thigh_pitch: mean, forward positive, both sides.
        thigh_swing: standard deviation of the thigh's pitch.
        knee_flexion: mean.
        knee_off_hinge: mean turn of the knee that is not flexion.
        foot_heading: mean of the feet in single stance, outward positive.
        foot_pitch: mean of a still foot, toes down positive.
        head_pitch: median forward tilt.
        toe_ahead: mean of the toe bases, forward of the hips joint.
        asymmetry: largest difference of left and right among thigh, knee and foot means.
        stance_toe: median height of a still toe base.
        toe_error_mm: mean distance of the skeleton's toe base to the rig's.
        leg_reach: 99th percentile of hip joint to ankle over the leg's length.
    """

    walking_s: float
    pelvis_pitch: float
    thigh_pitch: float
    thigh_swing: float
    knee_flexion: float
    knee_off_hinge: float
    foot_heading: float
    foot_pitch: float
    head_pitch: float
    toe_ahead: float
    asymmetry: float
    stance_toe: float
    toe_error_mm: float
    leg_reach: float


def walking_frames(motion: Motion) -> npt.NDArray[np.bool_]:
    """Frames (F,) of walking straight ahead and upright, at 0.5 to 2 m/s, for a second or more.

    A lunge or a kick moves as fast, but not for as long.
    """
    v = speed(motion.p_hips, motion.rate_hz, 0.5)
    ahead = heading(motion.R_local[:, Joint.HIPS])[:, :, 2]
    along = np.sum(v * ahead, axis=-1)
    fast = (along > 0.5) & (along < 2.0) & (along > 0.9 * np.hypot(v[:, 0], v[:, 2]))
    walks = fast & (motion.p_hips[:, 1] > 0.9)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], walks, [False]]).astype(int)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        walks[first:last] &= last - first >= motion.rate_hz
    return np.asarray(walks)


def _pitch(R: Array) -> Array:
    """Turn about X that takes Y forward, degrees."""
    return np.degrees(np.arctan2(R[..., 2, 1], R[..., 1, 1]))


def _frames(motion: Motion) -> dict[str, Array] | None:
    """Per walking frame: what :class:`Gait` averages."""
    walk = walking_frames(motion)
    if not walk.any():
        return None
    p, R = motion.joints()
    v_toes = np.linalg.norm(speed(motion.p_toes, motion.rate_hz, 0.1), axis=-1)[walk]
    p, R, local = p[walk], R[walk], motion.R_local[walk]
    R_ref = transpose(heading(R[:, Joint.HIPS]))[:, None]
    thighs = R_ref @ R[:, [leg[0] for leg in _LEGS]]
    feet = R_ref @ R[:, [leg[2] for leg in _LEGS]]
    knees = local[:, [leg[1] for leg in _LEGS]]
    flexion = np.degrees(np.arctan2(knees[..., 2, 1], knees[..., 1, 1]))
    off_hinge = np.degrees(np.arccos(np.clip(knees[..., 0, 0], -1.0, 1.0)))
    out = np.degrees(np.arctan2(feet[..., 0, 2], feet[..., 2, 2])) * [1.0, -1.0]
    still = v_toes < 0.2
    toes = p[:, [leg[3] for leg in _LEGS]]
    ahead = (R_ref @ (toes - p[:, :1])[..., None])[..., 2, 0]
    error = 1000.0 * np.linalg.norm(toes - motion.p_toes[walk], axis=-1)
    reach = np.linalg.norm(
        p[:, [leg[2] for leg in _LEGS]] - p[:, [leg[0] for leg in _LEGS]], axis=-1
    )
    return {
        "pelvis": _pitch(R_ref[:, 0] @ R[:, Joint.HIPS]),
        "head": _pitch(R_ref[:, 0] @ R[:, Joint.HEAD]),
        "thigh": -_pitch(thighs),
        "knee": flexion,
        "off_hinge": off_hinge,
        "heading": np.where(still, out, np.nan),
        "foot": np.where(still, np.degrees(np.arcsin(-feet[..., 1, 2])), np.nan),
        "toe": np.where(still, 100.0 * toes[..., 1], np.nan),
        "ahead": 100.0 * ahead,
        "error": error,
        "reach": reach / 0.84,
    }


class Agreement:
    """Collects motions by set."""

    def __init__(self) -> None:
        """Nothing seen yet."""
        self._frames: dict[str, list[dict[str, Array]]] = {}

    def add(self, motion: Motion) -> None:
        """Take in one motion; its set is the part of its name before the slash."""
        frames = _frames(motion)
        if frames is not None:
            self._frames.setdefault(motion.name.split("/")[0], []).append(frames)

    def gaits(self) -> dict[str, Gait]:
        """The means of each set that walks."""
        return {name: _gait(parts) for name, parts in sorted(self._frames.items())}


def _gait(parts: Sequence[dict[str, Array]]) -> Gait:
    all_ = {key: np.concatenate([p[key] for p in parts]) for key in parts[0]}
    sides = [np.nanmean(all_[key], axis=0) for key in ("thigh", "knee", "heading", "foot")]
    return Gait(
        walking_s=len(all_["pelvis"]) / 45.0,
        pelvis_pitch=float(np.mean(all_["pelvis"])),
        thigh_pitch=float(np.mean(all_["thigh"])),
        thigh_swing=float(np.std(all_["thigh"])),
        knee_flexion=float(np.mean(all_["knee"])),
        knee_off_hinge=float(np.mean(all_["off_hinge"])),
        foot_heading=float(np.nanmean(all_["heading"])),
        foot_pitch=float(np.nanmean(all_["foot"])),
        head_pitch=float(np.median(all_["head"])),
        toe_ahead=float(np.mean(all_["ahead"])),
        asymmetry=float(max(abs(s[0] - s[1]) for s in sides)),
        stance_toe=float(np.nanmedian(all_["toe"])),
        toe_error_mm=float(np.mean(all_["error"])),
        leg_reach=float(np.percentile(all_["reach"], 99.0)),
    )


def measure(motions: Iterable[Motion]) -> dict[str, Gait]:
    """Gait of each set among motions."""
    agreement = Agreement()
    for motion in motions:
        agreement.add(motion)
    return agreement.gaits()


def table(gaits: dict[str, Gait]) -> str:
    """A Markdown table, one row a set."""
    names = [f.name for f in fields(Gait)]
    rows = ["| set | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for name, gait in gaits.items():
        rows.append(f"| {name} | " + " | ".join(f"{getattr(gait, n):.2f}" for n in names) + " |")
    return "\n".join(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table for folders of clips."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", help="BVH files or folders of them")
    parser.add_argument("--every", type=int, default=1, help="only each N-th clip")
    options = parser.parse_args(arguments)
    try:
        clips = find_clips(options.paths)[:: options.every]
        print(table(measure(retarget(clips, notes=lambda note: print(note, file=sys.stderr)))))
    except LobstrError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
