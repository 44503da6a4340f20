"""Every frame is one activity, and it is the one that the points show."""

from dataclasses import replace

import numpy as np
import pytest

from lobstr_hw.evaluation.activities import Activity, activities
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.motion import Motion
from lobstr_hw.rotations import rotation_y
from lobstr_hw.skeleton import Joint

RATE_HZ = 45.0
FRAMES = 90


def standing_truth() -> Truth:
    """Two seconds of standing on the standard skeleton, arms down."""
    R_local = np.broadcast_to(np.eye(3), (FRAMES, 22, 3, 3)).copy()
    arm = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    R_local[:, Joint.LEFT_UPPER_ARM], R_local[:, Joint.RIGHT_UPPER_ARM] = arm, arm.T
    p_hips = np.tile([0.0, 1.0, 0.0], (FRAMES, 1))
    return Truth.of(
        Motion("made/up", "nobody", RATE_HZ, p_hips, R_local, np.zeros((FRAMES, 2, 3)), 1.0)
    )


def moving(v: tuple[float, float, float]) -> Truth:
    truth = standing_truth()
    way = np.arange(FRAMES)[:, None] / RATE_HZ * np.array(v)
    return replace(truth, p=truth.p + way[:, None], p_hips=truth.p_hips + way)


@pytest.mark.parametrize(
    ("v", "activity"),
    [
        ((0.0, 0.0, 0.0), Activity.STANDING),
        ((0.0, 0.0, 1.0), Activity.WALKING),
        ((0.0, 0.0, 3.0), Activity.RUNNING),
        ((0.0, 0.0, -0.8), Activity.BACKWARDS),
        ((0.8, 0.0, 0.1), Activity.SIDEWAYS),
        ((-0.8, 0.0, 0.1), Activity.SIDEWAYS),
        ((0.0, -0.3, 0.0), Activity.SINKING),
    ],
)
def test_the_pelvis_velocity_tells_the_activity(
    v: tuple[float, float, float], activity: Activity
) -> None:
    assert activities(moving(v))[FRAMES // 2] == activity


def test_low_hips_are_low_however_still() -> None:
    truth = standing_truth()
    assert set(activities(replace(truth, p_hips=truth.p_hips * 0.7))) == {Activity.LOW}


def test_a_pelvis_that_turns_in_place_is_turning() -> None:
    truth = standing_truth()
    turned = replace(truth, R_ref=rotation_y(np.arange(FRAMES) / RATE_HZ))
    assert set(activities(turned)) == {Activity.TURNING}


def test_a_hand_over_the_head_is_reaching() -> None:
    truth = standing_truth()
    p = truth.p.copy()
    p[:, 1] = p[:, 0] + [0.1, 0.05, 0.0]
    assert set(activities(replace(truth, p=p))) == {Activity.REACHING}


def test_what_is_done_does_not_depend_on_where_the_room_points() -> None:
    rng = np.random.default_rng(3)
    truth = standing_truth()
    way = np.cumsum(rng.normal(scale=0.02, size=(FRAMES, 3)) * [1.0, 0.1, 1.0], axis=0)
    truth = replace(truth, p=truth.p + way[:, None], p_hips=truth.p_hips + way)
    R = rotation_y(np.array(1.3))
    turned = replace(truth, p=truth.p @ R.T, p_hips=truth.p_hips @ R.T, R_ref=R @ truth.R_ref)
    assert (activities(turned) == activities(truth)).all()
