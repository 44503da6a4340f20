"""What the tools do with clips and with takes made from them, in one place."""

from dataclasses import replace

from lobstr_hw.calibration import Calibration, TPoseDetector, calibrate_t_pose
from lobstr_hw.motion import Motion
from lobstr_hw.simulation import SimulatedTake, take_samples


def first_seconds(motion: Motion, seconds: float) -> Motion:
    """The beginning of a motion, or all of a shorter one."""
    n = round(seconds * motion.rate_hz)
    return replace(
        motion, p_hips=motion.p_hips[:n], R_local=motion.R_local[:n], p_toes=motion.p_toes[:n]
    )


def calibrated(take: SimulatedTake) -> Calibration:
    """By the take's own T-pose.

    Raises:
        CalibrationError: none is found; says what is wrong.
    """
    detector = TPoseDetector({serial: role for role, serial in take.serials.items()})
    pose = detector.add(take_samples(take))
    if pose is None:
        raise detector.failure()
    return calibrate_t_pose(pose)
