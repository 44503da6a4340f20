"""Motion clips: resampling and mirroring."""

import numpy as np

from lobstr_hw.motion import Motion, mirrored, resampled
from lobstr_hw.rotations import rotation_y
from lobstr_hw.skeleton import mirror_points


def turning_walk(rate_hz: float = 30.0, frames: int = 31) -> Motion:
    t = np.arange(frames) / rate_hz
    R = np.tile(np.eye(3), (frames, 22, 1, 1))
    R[:, 0] = rotation_y(0.5 * t)
    R[:, 14] = rotation_y(0.3 * t)
    p = np.stack([0.2 * t, np.ones(frames), 1.1 * t], axis=-1)
    return Motion("set/clip", "someone", rate_hz, p, R, np.zeros((frames, 2, 3)), 0.95)


def test_resampling_an_even_motion_is_exact_and_keeps_its_length() -> None:
    at_30, at_45 = turning_walk(30.0, 31), turning_walk(45.0, 46)
    made = resampled(at_30, 45.0)
    assert len(made) == 46
    assert np.allclose(made.p_hips, at_45.p_hips)
    assert np.allclose(made.R_local, at_45.R_local)


def test_resampling_at_its_own_rate_changes_nothing() -> None:
    motion = turning_walk()
    assert np.allclose(resampled(motion, 30.0).R_local, motion.R_local)


def test_mirroring_twice_gives_the_motion_back() -> None:
    motion = turning_walk()
    twice = mirrored(mirrored(motion))
    assert np.array_equal(twice.R_local, motion.R_local)
    assert np.array_equal(twice.p_hips, motion.p_hips)
    assert np.array_equal(twice.p_toes, motion.p_toes)


def test_the_joints_of_a_mirrored_motion_are_the_mirrored_joints() -> None:
    motion = turning_walk()
    assert np.allclose(mirrored(motion).joints()[0], mirror_points(motion.joints()[0]))
