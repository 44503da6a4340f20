"""One T-pose -> a calibration (paper 4.2; design.md 4 says what one pose can give)."""

import numpy as np

from lobstr_hw.calibration.calibration import Calibration, Residuals
from lobstr_hw.calibration.heading import head_mount, pose_heading
from lobstr_hw.calibration.measures import fit_measures
from lobstr_hw.calibration.t_pose import TPose
from lobstr_hw.rotations import rotation_y, transpose
from lobstr_hw.trackers import FOUR_POINTS

__all__ = ["calibrate_t_pose"]


def calibrate_t_pose(
    pose: TPose, *, stature_m: float | None = None, floor_m: float = 0.0, created: str = ""
) -> Calibration:
    """Offsets, measures and heading of whoever stands in this T-pose.

    Hands and pelvis are taken to be held straight, for nothing tells how they are not; of the
    headset's turn the prior gets its share. The floor is where the tracking system says: one pose
    has nothing that touches it.

    Args:
        pose: as the detector gives it.
        stature_m: overrules what the headset's height says.
        floor_m: height of the floor in the tracking space.
        created: when this is, in the caller's words.
    """
    yaw, disagreement = pose_heading(pose.p[1], pose.p[2], pose.R[0])
    R_heading = rotation_y(yaw)
    p = (pose.p - np.array([0.0, floor_m, 0.0])) @ R_heading  # rows, so this is R^T p
    R_seen = transpose(R_heading) @ pose.R
    R_head, R_head_tracker = head_mount(R_seen[0])
    measures = fit_measures(p, R_head, stature_m)
    R_joint_tracker = np.concatenate([R_head_tracker[None], R_seen[1:]])
    # levers of hands and pelvis are in the heading, in which these joints are held straight
    p_tracker_joint = -(transpose(R_joint_tracker) @ measures.levers[..., None])[..., 0]
    return Calibration(
        roles=dict(zip(pose.serials, FOUR_POINTS, strict=True)),
        R_tracker_joint=transpose(R_joint_tracker),
        p_tracker_joint=p_tracker_joint,
        body=measures.body(),
        stature_m=measures.stature_m,
        floor_m=floor_m,
        heading_rad=yaw,
        residuals=Residuals(
            pose.spread_m,
            pose.spread_rad,
            disagreement,
            measures.misfit,
            measures.hips_height_deviation_m,
            measures.arm_deviation_m,
        ),
        created=created,
    )
