"""The paper's Table 3 and Figure 7 on made recordings: people of three statures wear trackers.

Each clip is done by a person of 157, 171 and 184 cm with proportions of their own, trackers on
at random places, Lighthouse errors and a sloppy T-pose, and is calibrated from that T-pose alone.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from made_takes import calibrated, first_seconds
from paper_rows import Trained
from paper_scores import legs_of
from split_clips import motions_named

from lobstr_hw.evaluation.activities import activities
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.features import (
    POINT_ROLES,
    Form,
    Points,
    clip_features,
    clip_points,
    reference_frames,
)
from lobstr_hw.lower_body import toes_in_reference, true_lower_body
from lobstr_hw.motion import Motion
from lobstr_hw.rotations import Array, geodesic_angle
from lobstr_hw.simulation import SimulatedTake, simulate
from lobstr_hw.skeleton import Joint, local_rotations
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT
from lobstr_hw.training.windowed import windowed

STATURES_CM = (157, 171, 184)
LONGEST_S = 20.0
SETTLE_S = 2.5
RATE_HZ = 45.0
CLIPS = (
    "snu_tiling_patch_mmk/mmk_march_hand_1",
    "snu_tiling_patch_mmk/mmk_box_2",
    "snu_tiling_patch_mmk/mmk_hello",
    "snu_tiling_patch_mmk/mmk_push",
    "snu_tiling_patch_mmk/mmk_dance",
    "cmu13_exercise/13_29",
    "cmu13_exercise/13_30",
    "cmu_01_08_09_11_55/01_01",
    "cmu_01_08_09_11_55/55_01",
    "snu_vsports_basketball/s_008_1_1",
    "snu_vsports_basketball/s_008_2_3",
    "snu_vsports_basketball/s_008_4_2",
    "snu_tiling_patch/1_chair",
    "snu_tiling_patch/1_move_to_high",
    "snu_tiling_patch/1_walk_clockwise",
    "snu_ys2010/VideoMotion_wd2_spiral_walk_fast10",
    "snu_ys2010/Physics2_wd2_WalkBackward00",
)
"""Nobody trained on them; the sets of the last five have other clips of the same people."""


@dataclass(frozen=True)
class Worn:
    """A recording through its calibration, and what the legs really did.

    Attributes:
        p, R, valid: (frames, 4, ...) joints on the standard skeleton, in the order of POINT_ROLES.
        scale: that the calibration found.
        apart_cm: (frames,) between the true toe bases, the user's centimetres.
        joints: (frames, 2, 4, 3, 3) the truth of C, U, L, F.
        activity: (frames,) of the truth.
        since: first frame that is scored.
    """

    p: Array
    R: Array
    valid: npt.NDArray[np.bool_]
    scale: float
    apart_cm: Array
    joints: Array
    activity: npt.NDArray[np.str_]
    since: int


@dataclass(frozen=True)
class Scored:
    """Of one stature and row: sums over the scored frames.

    Attributes:
        frames, apart_cm: by activity; the error of the distance between the toe bases.
        update_deg, true_update_deg: means of the joints' turns from frame to frame, summed up.
    """

    frames: dict[str, int]
    apart_cm: dict[str, float]
    update_deg: float
    true_update_deg: float

    @property
    def mean_cm(self) -> float:
        """Over all frames."""
        return sum(self.apart_cm.values()) / sum(self.frames.values())


def motions(data: Path) -> list[Motion]:
    """The first seconds of each clip."""
    return [first_seconds(motion, LONGEST_S) for motion in motions_named(data, CLIPS)]


def recordings(clips: Sequence[Motion], stature_cm: int, seed: int) -> list[Worn]:
    """Everybody does one clip; the same people's T-poses and errors for each stature."""
    return [_worn(simulate(m, seed + i, float(stature_cm))) for i, m in enumerate(clips)]


def _worn(take: SimulatedTake) -> Worn:
    calibration = calibrated(take)
    p, R, tracked = take.p[::2], take.R[::2], take.tracked[::2]  # 90 Hz to the grid's 45
    frame = calibration.frame(0.0, FOUR_POINTS, p, R, tracked, tracked)
    order = [FOUR_POINTS.index(role) for role in POINT_ROLES]
    truth = _truth(take)
    n = min(len(p), len(truth))
    toes = 100.0 * truth.p_toes / take.user.body.scale[0]
    return Worn(
        frame.p[:n, order],
        frame.R[:n, order],
        frame.valid_p[:n, order],
        calibration.scale,
        np.linalg.norm(toes[:n, 0] - toes[:n, 1], axis=-1),
        truth.joints[:n],
        activities(truth)[:n],
        round((take.t_pose_s[1] + SETTLE_S) * RATE_HZ),
    )


def _truth(take: SimulatedTake) -> Truth:
    """The take's own, brought to the standard skeleton's size; contacts are not used."""
    p, R = take.truth_p * take.user.body.scale[0], take.truth_R
    tracked = [ROLE_JOINT[role] for role in FOUR_POINTS]
    R_ref = reference_frames(R[:, Joint.HIPS])
    toes = p[:, [Joint.LEFT_TOES, Joint.RIGHT_TOES]]
    none = np.zeros((len(p), 2), dtype=bool)
    joints = true_lower_body(local_rotations(R), R_ref)
    hips = p[:, Joint.HIPS]
    return Truth(
        "take", RATE_HZ, p[:, tracked], R[:, tracked], hips, R_ref, joints, toes, none, none
    )


def scored(row: Trained, worn: Callable[[], Sequence[Worn]], kept: Path) -> Scored:
    """One row over the recordings of a stature; kept in a file, read from there if still true."""
    if kept.is_file():
        document = json.loads(kept.read_text(encoding="utf-8"))
        if document["steps"] == row.run.step:
            return Scored(**document["scored"])
    frames: dict[str, int] = {}
    apart: dict[str, float] = {}
    updates: list[Array] = []
    for take in worn():
        error, joints = _said(row, take)
        for activity in np.unique(take.activity[take.since :]):
            at = take.activity[take.since :] == activity
            frames[str(activity)] = frames.get(str(activity), 0) + int(at.sum())
            apart[str(activity)] = apart.get(str(activity), 0.0) + float(error[at].sum())
        updates.append(np.stack([_updates(joints), _updates(take.joints[take.since :])], axis=1))
    said, true = np.concatenate(updates).mean(axis=0)
    result = Scored(frames, apart, float(said), float(true))
    document = {"steps": row.run.step, "scored": vars(result)}
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return result


def _said(row: Trained, take: Worn) -> tuple[Array, Array]:
    """Errors (frames,) of the toe bases' distance in cm, and the joints; of the scored frames."""
    form = row.config.feature_form
    x = clip_features(_points(take, form), form, take.scale)
    joints, _ = legs_of(windowed(row.run, row.config, x, take.since, len(x)))
    toes = 100.0 * toes_in_reference(joints) / take.scale
    apart_cm = np.linalg.norm(toes[:, 0] - toes[:, 1], axis=-1)
    return np.abs(apart_cm - take.apart_cm[take.since :]), joints


def _points(take: Worn, form: Form) -> Points:
    return clip_points(take.p, take.R, take.valid, take.valid, form)


def _updates(joints: Array) -> Array:
    """Degrees (frames - 1,) by which the eight joints together turn from frame to frame."""
    return np.asarray(np.rad2deg(geodesic_angle(joints[1:], joints[:-1]).sum(axis=(1, 2))))
