"""Laws of people who are made to sit: feet stay, hips never rise, legs hang on the hips."""

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import leg_points_in_reference, pose_from_6d
from lobstr_hw.rotations import Array
from lobstr_hw.training.dataset import Clips
from lobstr_hw.training.replaced_legs import HIPS
from lobstr_hw.training.sitting import sat_down

SEEDS = range(12)


@pytest.fixture(scope="module")
def clips() -> Clips:
    return Clips.of([walking(8.0, speed_m_s=0.0, turn_rad_s=0.0, seed=1)])


def arrays(clips: Clips) -> tuple[Array, Array, Array]:
    p, R, pose = (np.asarray(a, dtype=np.float64) for a in (clips.p, clips.R, clips.pose))
    return p, R, pose


def points_in_world(p: Array, R: Array, pose: Array) -> Array:
    """Hip, knee, ankle and toe base (frames, 2, 4, 3)."""
    points = leg_points_in_reference(pose_from_6d(pose))
    R_ref = reference_frames(R[:, HIPS])[:, None, None]
    return np.asarray(p[:, HIPS, None, None] + (R_ref @ points[..., None])[..., 0])


def test_feet_stay_and_hips_never_rise(clips: Clips) -> None:
    p, R, pose = arrays(clips)
    feet = points_in_world(p, R, pose)[:, :, 2:]
    changed = 0
    for seed in SEEDS:
        low_p, low_R, low_pose = sat_down(p, R, pose, 45.0, np.random.default_rng(seed))
        changed += low_p is not p
        np.testing.assert_allclose(
            points_in_world(low_p, low_R, low_pose)[:, :, 2:], feet, atol=1e-6
        )
        assert (low_p[:, HIPS, 1] <= p[:, HIPS, 1] + 1e-9).all()
    assert changed > len(SEEDS) // 2


def test_the_legs_hang_on_the_lowered_hips(clips: Clips) -> None:
    p, R, pose = arrays(clips)
    for seed in SEEDS:
        _, low_R, low_pose = sat_down(p, R, pose, 45.0, np.random.default_rng(seed))
        R_ref = reference_frames(low_R[:, HIPS])
        C = pose_from_6d(low_pose)[:, :, 0]
        said = R_ref[:, None] @ C
        np.testing.assert_allclose(said, np.stack([low_R[:, HIPS]] * 2, axis=1), atol=1e-6)


def test_nothing_jumps(clips: Clips) -> None:
    """Knees and hips are as smooth as minimum-jerk paths of half a second and more make them."""
    p, R, pose = arrays(clips)
    before = np.abs(np.diff(points_in_world(p, R, pose), axis=0)).max()
    for seed in SEEDS:
        low = sat_down(p, R, pose, 45.0, np.random.default_rng(seed))
        step = np.abs(np.diff(points_in_world(*low), axis=0)).max()
        assert step < before + 0.06, "metres in a 45th of a second"


def test_the_same_draw_sits_alike(clips: Clips) -> None:
    one, two = (sat_down(*arrays(clips), 45.0, np.random.default_rng(5)) for _ in range(2))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a, b)


def test_who_walks_does_not_sit() -> None:
    there = arrays(Clips.of([walking(4.0)]))
    for one, other in zip(sat_down(*there, 45.0, np.random.default_rng(0)), there, strict=True):
        assert one is other
