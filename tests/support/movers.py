"""People who move to be calibrated, for tests."""

from dataclasses import replace
from functools import cache

import numpy as np

from lobstr_hw.calibration import (
    Movement,
    Refinement,
    TPose,
    TPoseDetector,
    movement_from_samples,
    refine_by_movement,
)
from lobstr_hw.motion import Motion
from lobstr_hw.simulation import (
    Habits,
    Performance,
    SimulatedTake,
    Sway,
    TrackingErrors,
    calibrating_movement,
    drawn_user,
    simulate,
    take_samples,
)

IDEAL_HABITS = Habits(
    nod_axis=np.array([1.0, 0.0, 0.0]),
    shake_axis=np.array([0.0, 1.0, 0.0]),
    twist_axis=np.tile([1.0, 0.0, 0.0], (2, 1)),
    bend_axis=np.tile([0.0, 0.0, 1.0], (2, 1)),
    neck_share=0.33,
    walking=np.zeros(2),
    pivot_m=np.zeros(2),
    knees=0.0,
    tempo=1.0,
)


def somebodys_movement(seed: int, time: int = 0) -> Motion:
    """The person of this seed, at one time or another."""
    habits = Habits.drawn(np.random.default_rng([seed, 6]))
    return calibrating_movement(habits, np.random.default_rng([seed, 7, time]))


def ideal_movement(seed: int) -> Motion:
    """Everything as the anatomist has it; how far and how often is drawn."""
    rng = np.random.default_rng([seed, 7])
    now = replace(
        Performance.drawn(rng),
        twist_slip=np.zeros((2, 3)),
        bend_slip=np.zeros((2, 3)),
        nod_slip=np.zeros(3),
        shake_slip=np.zeros(3),
        posture_pelvis=np.zeros(3),
        posture_head=np.zeros(3),
        bow_twist=np.zeros(2),
        walk_yaw=0.0,
        pivot_m=np.zeros(2),
    )
    return calibrating_movement(IDEAL_HABITS, rng, now)


@cache
def somebodys_take(seed: int, time: int = 0) -> SimulatedTake:
    """T-pose and movement of the person of this seed, with a Lighthouse's errors."""
    return simulate(somebodys_movement(seed, time), seed + 1_000_000 * time, user=drawn_user(seed))


def ideal_take(seed: int, pose_deviation_deg: float = 10.0) -> SimulatedTake:
    """An ideal movement after a sloppy T-pose, perfectly tracked."""
    return simulate(
        ideal_movement(seed),
        seed,
        errors=TrackingErrors.none(),
        sway=Sway.none(),
        pose_deviation_deg=pose_deviation_deg,
    )


def pose_and_recording(take: SimulatedTake) -> tuple[TPose, Movement]:
    """The T-pose of a take, and all of it on one time grid."""
    samples = list(take_samples(take))
    detector = TPoseDetector({serial: role for role, serial in take.serials.items()})
    pose = detector.add(s for s in samples if s.time_s >= 0.8)
    assert pose is not None, detector.failure()
    return pose, movement_from_samples(samples, pose.serials)


def refined(take: SimulatedTake) -> Refinement:
    """What the movement makes of a take."""
    pose, recording = pose_and_recording(take)
    return refine_by_movement(pose, recording.between(pose.end_s))
