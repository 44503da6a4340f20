"""Bodies from measures."""

import numpy as np
import pytest

from lobstr_hw.proportions import (
    STANDARD_ARM,
    STANDARD_TRUNK,
    STANDARD_WIDTH,
    body_from_measures,
    eyes_in_head,
)
from lobstr_hw.skeleton import EYES, STATURE, Body, Joint, forward_kinematics, mirror_points


def one(*measures: float) -> Body:
    return body_from_measures(*(np.array([m]) for m in measures))


def test_standard_measures_give_the_standard_skeleton() -> None:
    body = one(1.0, STANDARD_TRUNK, STANDARD_ARM, STANDARD_WIDTH)
    np.testing.assert_allclose(body.offsets, Body.standard().offsets, atol=1e-12)
    np.testing.assert_allclose(body.sole, Body.standard().sole)
    np.testing.assert_allclose(body.scale, 1.0)


def test_eyes_of_the_standard_stature_are_the_standard_eyes() -> None:
    np.testing.assert_allclose(eyes_in_head(np.array([STATURE])), EYES[None])


@pytest.mark.parametrize("seed", range(5))
def test_every_measure_can_be_read_off_the_body(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hips, trunk, arm, width = rng.uniform(0.8, 1.2, 4) * [1.0, 0.5, 0.5, 0.35]
    body = one(hips, trunk, arm, width)
    straight = np.broadcast_to(np.eye(3), (1, 22, 3, 3))
    p = forward_kinematics(straight, np.array([[0.0, hips, 0.0]]), body.offsets)[0][0]
    assert p[Joint.HEAD, 1] - p[Joint.HIPS, 1] == pytest.approx(trunk)
    assert p[Joint.LEFT_UPPER_ARM, 0] - p[Joint.RIGHT_UPPER_ARM, 0] == pytest.approx(width)
    assert p[Joint.LEFT_HAND, 0] - p[Joint.LEFT_UPPER_ARM, 0] == pytest.approx(arm)
    assert p[Joint.LEFT_TOES, 1] == pytest.approx(body.sole[0])  # the soles are on the floor
    assert body.scale[0] == pytest.approx(1.0 / hips)
    np.testing.assert_allclose(mirror_points(p), p, atol=1e-12)


def test_many_bodies_are_made_at_once() -> None:
    measures = np.random.default_rng(0).uniform(0.4, 1.0, (4, 7))
    together = body_from_measures(*measures)
    for i in range(7):
        np.testing.assert_array_equal(together.offsets[i], one(*measures[:, i]).offsets[0])
