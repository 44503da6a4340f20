"""A calibration changed while it is in use: offsets only, the body stays (design.md 2)."""

from dataclasses import replace

import numpy as np

from lobstr_hw.calibration.calibration import Calibration
from lobstr_hw.calibration.heading import turn_between
from lobstr_hw.errors import CalibrationError
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, heading_angle, rotation_y, slerp, transpose
from lobstr_hw.trackers import TrackerRole

__all__ = ["between", "in_new_space", "with_floor", "with_heading", "with_offsets_of"]

LARGEST_TURN = np.deg2rad(90.0)
"""Beyond this somebody looks over the shoulder, or the tracker was put on another side."""
_DEFINED = 0.2
"""Of a heading: a joint that lies on its back has none."""


def with_floor(calibration: Calibration, raise_m: float) -> Calibration:
    """The whole body higher over the floor by so much, as when its feet are too low."""
    return replace(calibration, floor_m=calibration.floor_m - raise_m)


def with_heading(calibration: Calibration, R_trackers: dict[TrackerRole, Array]) -> Calibration:
    """The pelvis faces where the head does: for a belt that slipped round, or a drifted IMU.

    The person looks straight ahead, hips and head the same way. A tracker that goes round the body
    on its belt keeps its place in it, so only the pelvis' turn about the vertical changes.

    Args:
        calibration: in use.
        R_trackers: (3, 3) of head and pelvis now, in the tracking space.

    Raises:
        CalibrationError: one of the two is not there, or they differ too much.
    """
    R_joint = {role: _joint(calibration, role, R_trackers) for role in _WANTED}
    yaw = {}
    for role, R in R_joint.items():
        angle, defined = heading_angle(R)
        if defined < _DEFINED:
            raise CalibrationError(f"the {role} faces up or down: stand upright and try again.")
        yaw[role] = float(angle)
    turn = float(turn_between(yaw[TrackerRole.HEAD], yaw[TrackerRole.PELVIS]))
    if abs(turn) > LARGEST_TURN:
        raise CalibrationError(
            f"head and pelvis differ by {abs(np.rad2deg(turn)):.0f} degrees: look straight ahead, "
            "or calibrate anew."
        )
    i = list(calibration.roles.values()).index(TrackerRole.PELVIS)
    R = np.array(calibration.R_tracker_joint)
    R[i] = transpose(R_trackers[TrackerRole.PELVIS]) @ rotation_y(turn) @ R_joint[_WANTED[1]]
    return replace(calibration, R_tracker_joint=R)


_WANTED = (TrackerRole.HEAD, TrackerRole.PELVIS)


def _joint(
    calibration: Calibration, role: TrackerRole, R_trackers: dict[TrackerRole, Array]
) -> Array:
    serial = calibration.serial_of(role)
    if serial is None or role not in R_trackers:
        raise CalibrationError(f"no tracker in sight for the {role}: wait until it is back.")
    return np.asarray(R_trackers[role] @ calibration.T_tracker_joint(serial).R)


def with_offsets_of(calibration: Calibration, newer: Calibration) -> Calibration:
    """A later calibration of the same session: its offsets and floor, the body kept."""
    return replace(newer, body=calibration.body, stature_m=calibration.stature_m)


def in_new_space(calibration: Calibration, T_new_old: Pose) -> Calibration:
    """The same calibration after the tracking space was set up anew, by a turn about Y and a shift.

    How trackers sit does not depend on it; where the floor is and where the person faced do. So
    does where other tracking spaces lie, if they did not move along: those have to be joined again.
    """
    turn = float(heading_angle(T_new_old.R)[0])
    return replace(
        calibration,
        floor_m=calibration.floor_m + float(T_new_old.p[1]),
        heading_rad=float(turn_between(calibration.heading_rad + turn, 0.0)),
    )


def between(old: Calibration, new: Calibration, share: float) -> Calibration:
    """On the way from one to the other, so that nothing jumps.

    Trackers that changed their roles cannot be met half-way: then it is the new one at once.
    """
    if share >= 1.0 or old.roles != new.roles:
        return new
    return replace(
        new,
        R_tracker_joint=slerp(old.R_tracker_joint, new.R_tracker_joint, share),
        p_tracker_joint=old.p_tracker_joint + share * (new.p_tracker_joint - old.p_tracker_joint),
        floor_m=old.floor_m + share * (new.floor_m - old.floor_m),
    )
