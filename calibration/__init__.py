"""From a T-pose and movement to offsets and body measures: pure functions, and the profile."""

from lobstr_hw.calibration.calibration import Calibration, Residuals, TrackingSpace
from lobstr_hw.calibration.from_t_pose import calibrate_t_pose
from lobstr_hw.calibration.movement import Quantity, Refinement, refine_by_movement
from lobstr_hw.calibration.profile import load_profile, save_profile
from lobstr_hw.calibration.recording import Movement, movement_from_samples
from lobstr_hw.calibration.self_check import SelfCheck, check_calibration
from lobstr_hw.calibration.spaces import SpaceAlignment, align_spaces
from lobstr_hw.calibration.start_check import StartCheck, check_devices, check_start
from lobstr_hw.calibration.t_pose import Check, TPose, TPoseDetector, TPoseQuality

__all__ = [
    "Calibration",
    "Check",
    "Movement",
    "Quantity",
    "Refinement",
    "Residuals",
    "SelfCheck",
    "SpaceAlignment",
    "StartCheck",
    "TPose",
    "TPoseDetector",
    "TPoseQuality",
    "TrackingSpace",
    "align_spaces",
    "calibrate_t_pose",
    "check_calibration",
    "check_devices",
    "check_start",
    "load_profile",
    "movement_from_samples",
    "refine_by_movement",
    "save_profile",
]
