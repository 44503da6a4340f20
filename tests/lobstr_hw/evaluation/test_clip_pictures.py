"""The legs that are drawn end where the toes are scored."""

import numpy as np

from lobstr_hw.evaluation.clip_pictures import leg_points
from lobstr_hw.lower_body import toes_in_reference
from lobstr_hw.rotations import from_rotation_vector


def test_the_drawn_legs_end_at_the_toes_and_keep_their_lengths() -> None:
    joints = from_rotation_vector(np.random.default_rng(1).normal(scale=0.7, size=(5, 2, 4, 3)))
    points = leg_points(joints)
    np.testing.assert_allclose(points[..., 3, :], toes_in_reference(joints), atol=1e-12)
    straight = leg_points(np.broadcast_to(np.eye(3), joints.shape))
    bones, own = (np.linalg.norm(np.diff(p, axis=-2), axis=-1) for p in (points, straight))
    np.testing.assert_allclose(bones, own, atol=1e-12)
