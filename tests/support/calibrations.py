"""Simulated people, calibrated: the way from a take to a calibration, for tests."""

import numpy as np

from lobstr_hw.calibration import Calibration, TPose, TPoseDetector, calibrate_t_pose
from lobstr_hw.poses import Pose
from lobstr_hw.proportions import STANDARD_ARM, STANDARD_WIDTH, body_from_measures, eyes_in_head
from lobstr_hw.rotations import Array, rotation_y
from lobstr_hw.simulation import SimulatedTake, SimulatedUser, take_samples
from lobstr_hw.simulation.noise import random_rotations
from lobstr_hw.skeleton import STATURE, Body
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole


def found_t_pose(take: SimulatedTake, *, hinted: bool = True) -> TPose:
    """The T-pose of a take; the test fails with the detector's words when there is none."""
    hints = {serial: role for role, serial in take.serials.items()} if hinted else {}
    detector = TPoseDetector(hints)
    pose = detector.add(take_samples(take))
    assert pose is not None, detector.failure()
    return pose


def calibrated(take: SimulatedTake, stature_m: float | None = None) -> Calibration:
    """The calibration of a take."""
    return calibrate_t_pose(found_t_pose(take), stature_m=stature_m)


def mean_body(stature_m: float) -> Body:
    """The body that the priors expect of someone of this stature."""
    hips = 0.586 * stature_m
    trunk = 0.936 * stature_m - float(eyes_in_head(np.array(stature_m))[1]) - hips
    size = stature_m / STATURE
    parts = (hips, trunk, STANDARD_ARM * size, STANDARD_WIDTH * size)
    return body_from_measures(*(np.array([part]) for part in parts))


def expected_user(
    rng: np.random.Generator, stature_m: float, heading_rad: float, origin: Array
) -> SimulatedUser:
    """Someone who is in everything what the priors expect, but for the turns of three mounts."""
    R = random_rotations(rng, 3)
    mounts = {
        TrackerRole.HEAD: Pose(rotation_y(np.pi), eyes_in_head(np.array(stature_m))),
        TrackerRole.LEFT_HAND: Pose(R[0], np.array([0.08, 0.0, 0.0])),
        TrackerRole.RIGHT_HAND: Pose(R[1], np.array([-0.08, 0.0, 0.0])),
        TrackerRole.PELVIS: Pose(R[2], np.array([0.0, 0.02, 0.115])),
    }
    return SimulatedUser(
        stature_m,
        mean_body(stature_m),
        mounts,
        Pose(rotation_y(heading_rad), origin),
        {role: f"T-{role}" for role in FOUR_POINTS},
    )
