"""Laws of other people's strides: feet that stand stand, ways are stretched, legs are legs."""

import numpy as np
import pytest

from lobstr_hw.features import reference_frames
from lobstr_hw.ik.vectors import rotate
from lobstr_hw.lower_body import leg_points_in_reference, pose_from_6d
from lobstr_hw.rotations import Array
from lobstr_hw.simulation import Habits, calibrating_movement
from lobstr_hw.training.dataset import Clips
from lobstr_hw.training.replaced_legs import HIPS
from lobstr_hw.training.strides import Stride, with_other_strides

RATE_HZ = 45.0


@pytest.fixture(scope="module", params=[1, 2])
def clips(request: pytest.FixtureRequest) -> Clips:
    """Somebody who stands, walks and turns with feet that do not slip."""
    rng = np.random.default_rng(request.param)
    return Clips.of([calibrating_movement(Habits.drawn(rng), rng)])


def strode(clips: Clips, length: float, out_m: float) -> tuple[Array, Array, Array, Array]:
    """Points and pose before and after."""
    p, R, pose = (np.asarray(a, dtype=np.float64) for a in (clips.p, clips.R, clips.pose))
    how = Stride(length, out_m)
    new_p, new_pose = with_other_strides(p, R, pose, clips.contact.astype(np.int64), RATE_HZ, how)
    return p, pose, new_p, new_pose


def toes(clips: Clips, p: Array, pose: Array) -> Array:
    """(frames, 2, 3) in the world."""
    R_ref = reference_frames(np.asarray(clips.R, dtype=np.float64)[:, HIPS])[:, None]
    points = leg_points_in_reference(pose_from_6d(pose))[:, :, 3]
    return np.asarray(p[:, None, HIPS] + rotate(R_ref, points))


def slip(clips: Clips, p_toes: Array) -> float:
    """Metres per second in the mean, where a foot stands."""
    stands = clips.contact[1:] & clips.contact[:-1]
    return float(np.linalg.norm(np.diff(p_toes, axis=0), axis=-1)[stands].mean() * RATE_HZ)


@pytest.mark.parametrize("how", [(0.85, 0.0), (1.1, 0.0), (1.0, 0.06), (0.9, 0.06)])
def test_feet_that_stand_stand_as_still_as_before(clips: Clips, how: tuple[float, float]) -> None:
    p, pose, new_p, new_pose = strode(clips, *how)
    assert new_p is not p
    before, now = slip(clips, toes(clips, p, pose)), slip(clips, toes(clips, new_p, new_pose))
    assert now <= 1.2 * before + 0.005


def test_the_way_of_hips_and_feet_is_stretched_alike(clips: Clips) -> None:
    p, pose, new_p, new_pose = strode(clips, 0.85, 0.0)
    flat = np.array([0, 2])
    origin = p[0, HIPS, flat]
    np.testing.assert_allclose(
        new_p[:, HIPS][:, flat] - origin, 0.85 * (p[:, HIPS][:, flat] - origin), atol=1e-9
    )
    ankles = [
        leg_points_in_reference(pose_from_6d(x))[:, :, 2][..., flat] for x in (pose, new_pose)
    ]
    np.testing.assert_allclose(ankles[1], 0.85 * ankles[0], atol=1e-6)


def test_feet_further_apart_lower_the_hips_and_nothing_else_of_the_body_turns(
    clips: Clips,
) -> None:
    p, pose, new_p, new_pose = strode(clips, 1.0, 0.08)
    assert (new_p[:, HIPS, 1] < p[:, HIPS, 1] - 0.002).all()
    np.testing.assert_allclose(new_p - new_p[:, :1], p - p[:, :1], atol=1e-9)
    wide = [np.abs(np.diff(toes(clips, *x), axis=1)) for x in ((p, pose), (new_p, new_pose))]
    distance = [np.linalg.norm(w[..., [0, 2]], axis=-1).mean() for w in wide]
    assert distance[1] > distance[0] + 0.03


def test_hips_do_not_jerk(clips: Clips) -> None:
    p, _, new_p, _ = strode(clips, 1.1, 0.06)
    jerk = [np.abs(np.diff(x[:, HIPS, 1], 3)).max() for x in (p, new_p)]
    assert jerk[1] < jerk[0] + 0.004


def test_strides_that_legs_cannot_do_leave_all_as_it_is(clips: Clips) -> None:
    p, pose, new_p, new_pose = strode(clips, 3.0, 0.0)
    assert new_p is p
    assert new_pose is pose
