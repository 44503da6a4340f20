"""From a T-pose and movement to offsets and body measures: pure functions, and the profile."""

from lobstr_hw.calibration.calibration import Calibration, Residuals
from lobstr_hw.calibration.from_t_pose import calibrate_t_pose
from lobstr_hw.calibration.movement import Quantity, Refinement, refine_by_movement
from lobstr_hw.calibration.profile import load_profile, save_profile
from lobstr_hw.calibration.recording import Movement, movement_from_samples
from lobstr_hw.calibration.t_pose import Check, TPose, TPoseDetector, TPoseQuality

__all__ = [
    "Calibration",
    "Check",
    "Movement",
    "Quantity",
    "Refinement",
    "Residuals",
    "TPose",
    "TPoseDetector",
    "TPoseQuality",
    "calibrate_t_pose",
    "load_profile",
    "movement_from_samples",
    "refine_by_movement",
    "save_profile",
]
