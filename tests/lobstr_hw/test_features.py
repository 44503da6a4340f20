"""Laws of the network's input."""

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.features import (
    INPUT_SIZE,
    POINT_JOINTS,
    POINT_ROLES,
    Form,
    Points,
    clip_features,
    clip_points,
    features,
    input_size,
    mirror_features,
    reference_frame,
    reference_frames,
)
from lobstr_hw.motion import mirrored
from lobstr_hw.rotations import Array, from_6d, from_rotation_vector, rotation_x, rotation_y
from lobstr_hw.trackers import ROLE_JOINT

FORMS: tuple[Form, ...] = ("v1", "paper", "position", "combined")
IDENTITY_6D = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0]


def moving(seed: int = 0, frames: int = 40) -> tuple[Array, Array]:
    """Four points that move and turn at random, the pelvis upright enough to have a heading."""
    rng = np.random.default_rng(seed)
    p = np.cumsum(rng.normal(0.0, 0.02, (frames, 4, 3)), axis=0) + rng.normal(0.0, 1.0, (4, 3))
    turn = np.cumsum(rng.normal(0.0, 0.04, (frames, 4, 3)), axis=0)
    start = from_rotation_vector(rng.normal(0.0, 1.0, (4, 3)))
    start[0] = rotation_y(rng.uniform(-3.0, 3.0))
    return p, from_rotation_vector(turn) @ start


def rows(x: Array) -> Array:
    return x[..., :-1].reshape(*x.shape[:-1], 4, 9)


def test_the_points_are_hips_head_and_hands() -> None:
    assert [role.value for role in POINT_ROLES] == ["pelvis", "head", "left_hand", "right_hand"]
    assert POINT_JOINTS == tuple(ROLE_JOINT[role] for role in POINT_ROLES)
    assert INPUT_SIZE == 37


@pytest.mark.parametrize("form", FORMS)
def test_turning_and_moving_the_world_changes_nothing(form: Form) -> None:
    p, R = moving()
    yaw = rotation_y(2.1)
    x = clip_features(clip_points(p, R, form=form), form)
    moved = clip_features(
        clip_points(p @ yaw.T + np.array([3.0, 0.0, -5.0]), yaw @ R, form=form), form
    )
    if form == "v1":
        assert moved == pytest.approx(x, abs=1e-9)
    else:  # row 0 as printed keeps the absolute heading
        assert moved[:, 9:] == pytest.approx(x[:, 9:], abs=1e-9)
        assert np.abs(moved[:, 3:9] - x[:, 3:9]).max() > 0.1


def test_the_angular_velocity_does_not_know_the_mounts() -> None:
    p, R = moving()
    mounts = from_rotation_vector(np.random.default_rng(1).normal(0.0, 1.5, (4, 3)))
    mounts[0] = np.eye(3)  # the reference frame needs the pelvis' own heading
    x = rows(clip_features(clip_points(p, R)))
    mounted = rows(clip_features(clip_points(p, R @ mounts)))
    assert mounted[..., 3:] == pytest.approx(x[..., 3:], abs=1e-9)


def test_only_the_last_number_feels_the_height() -> None:
    p, R = moving()
    x = clip_features(clip_points(p, R))
    raised = clip_features(clip_points(p + np.array([0.0, 0.3, 0.0]), R))
    assert raised[:, :-1] == pytest.approx(x[:, :-1], abs=1e-12)
    assert raised[:, -1] == pytest.approx(x[:, -1] + 0.3)


def test_velocities_are_in_the_pelvis_heading_and_per_step() -> None:
    """Walking where the pelvis faces is +Z for the network, whatever the compass says."""
    R = np.broadcast_to(rotation_y(np.pi / 2.0), (3, 4, 3, 3))  # facing world +X
    p = np.zeros((3, 4, 3))
    p[:, :, 0] = 0.02 * np.arange(3)[:, None]
    x = rows(clip_features(clip_points(p, R)))
    assert x[1:, :, :3] == pytest.approx(np.broadcast_to([0.0, 0.0, 0.02], (2, 4, 3)), abs=1e-12)
    assert x[..., 3:] == pytest.approx(np.broadcast_to(IDENTITY_6D, (3, 4, 6)), abs=1e-12)


def test_the_angular_velocity_is_the_turn_seen_from_the_pelvis() -> None:
    heading, turn = rotation_y(1.0), rotation_x(0.1)
    R = np.stack([np.broadcast_to(heading, (4, 3, 3))] * 2)
    R[1, 1] = heading @ turn  # the head nods about the pelvis' own X
    x = rows(clip_features(clip_points(np.zeros((2, 4, 3)), R)))
    assert from_6d(x[1, 1, 3:]) == pytest.approx(turn, abs=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_left_and_right_exchanged_is_the_mirrored_input(form: Form) -> None:
    walk = walking(2.0)
    straight, reflected = (
        clip_features(clip_points(p[:, POINT_JOINTS], R[:, POINT_JOINTS], form=form), form)
        for p, R in (walk.joints(), mirrored(walk).joints())
    )
    assert mirror_features(straight) == pytest.approx(reflected, abs=1e-9)
    assert mirror_features(mirror_features(straight)) == pytest.approx(straight)
    assert np.abs(reflected - straight).max() > 1e-3


@pytest.mark.parametrize("form", FORMS)
def test_a_clip_at_once_is_the_same_as_step_by_step(form: Form) -> None:
    p, R = moving(frames=60)
    R[20:30, 0] = R[20:30, 0] @ rotation_x(np.pi / 2.0)  # bowing: hardly a heading
    R[30:35, 0] = rotation_x(np.pi)  # upside down: none
    points = clip_points(p, R, form=form)
    x = clip_features(points, form)
    last, started = np.eye(3), np.array(False)
    before = points.take(0)
    for i in range(len(p)):
        now = points.take(i)
        R_ref = reference_frame(now.R[0], last, started, form)
        now = Points(now.p, now.R, now.valid_p, now.valid_R, R_ref)
        step = features(before, now, started, form)
        assert step == pytest.approx(x[i], abs=1e-12)
        last, before, started = R_ref, now, np.array(True)


def test_many_clips_side_by_side_are_the_same_as_one_by_one() -> None:
    pairs = [moving(seed) for seed in range(3)]
    p, R = (np.stack(arrays, axis=1) for arrays in zip(*pairs, strict=True))
    x = clip_features(clip_points(p, R))
    for k, pair in enumerate(pairs):
        assert x[:, k] == pytest.approx(clip_features(clip_points(*pair)), abs=1e-12)


def test_the_last_good_heading_is_kept_while_there_is_none() -> None:
    yaw = rotation_y(0.7)
    upside_down = rotation_x(np.pi)
    R_hips = np.stack([yaw, upside_down, upside_down, rotation_y(-0.2)])
    R_ref = reference_frames(R_hips)
    assert R_ref[1] == pytest.approx(yaw)
    assert R_ref[2] == pytest.approx(yaw)
    assert R_ref[3] == pytest.approx(rotation_y(-0.2))


def test_a_part_of_a_recording_goes_on_with_the_heading_from_before_it() -> None:
    yaw, upside_down = rotation_y(np.array([0.3, 1.1])), rotation_x(np.pi)
    R_hips = np.stack([yaw, *[np.stack([upside_down] * 2)] * 3, rotation_y(np.array([-0.2, 0.6]))])
    R_hips[2, 1] = rotation_y(0.9)
    whole = reference_frames(R_hips)
    np.testing.assert_allclose(reference_frames(R_hips[1:], first=whole[0]), whole[1:])


def test_bowing_beyond_ninety_degrees_keeps_the_heading() -> None:
    yaw = rotation_y(0.5)
    assert reference_frame(yaw @ rotation_x(2.0)) == pytest.approx(yaw)


def test_the_first_frame_and_a_gap_give_no_movement() -> None:
    p, R = moving()
    points = clip_points(p, R)
    still = np.array([0.0, 0.0, 0.0, *IDENTITY_6D])
    assert rows(clip_features(points)[0]) == pytest.approx(np.tile(still, (4, 1)))
    x = features(points.take(3), points.take(9), np.array(False))
    assert rows(x) == pytest.approx(np.tile(still, (4, 1)))
    assert x[-1] == points.p[9, 0, 1]


@pytest.mark.parametrize("what", ["valid_p", "valid_R"])
def test_a_role_whose_validity_changes_gives_no_movement_for_that_step(what: str) -> None:
    p, R = moving()
    valid = np.ones((len(p), 4), dtype=bool)
    valid[10:20, 2] = False
    x = rows(clip_features(clip_points(p, R)))
    everywhere = np.ones_like(valid)
    masks = (valid, everywhere) if what == "valid_p" else (everywhere, valid)
    broken = rows(clip_features(clip_points(p, R, *masks)))
    changed, kept = (slice(3), slice(3, 9)) if what == "valid_p" else (slice(3, 9), slice(3))
    still = [0.0, 0.0, 0.0] if what == "valid_p" else IDENTITY_6D
    for i in (10, 20):
        assert broken[i, 2, changed] == pytest.approx(still)
        assert broken[i, 2, kept] == pytest.approx(x[i, 2, kept])
        x[i, 2] = broken[i, 2]
    assert broken == pytest.approx(x)


@pytest.mark.parametrize("form", FORMS[1:])
def test_the_papers_forms_scale_nothing_but_the_height(form: Form) -> None:
    p, R = moving()
    s = 1.25
    user = clip_features(clip_points(p / s, R, form=form), form)
    scaled = clip_features(clip_points(p, R, form=form), form, scale=s)
    assert scaled[:, :-1] == pytest.approx(user[:, :-1])
    assert scaled[:, -1] == pytest.approx(s * user[:, -1])


def test_places_are_those_of_head_and_hands_seen_from_the_pelvis() -> None:
    p, R = moving()
    x = {form: clip_features(clip_points(p, R, form=form), form) for form in FORMS}
    assert {form: x[form].shape[1] for form in FORMS} == {form: input_size(form) for form in FORMS}
    to_ref = np.swapaxes(reference_frames(R[:, 0], "position"), -1, -2)[:, None]
    seen = x["position"][:, 9:-1].reshape(-1, 3, 9)
    assert seen[..., :3] == pytest.approx((to_ref @ (p[:, 1:] - p[:, :1])[..., None])[..., 0])
    assert from_6d(seen[..., 3:]) == pytest.approx(to_ref @ R[:, 1:])
    assert x["position"][:, :9] == pytest.approx(x["paper"][:, :9])
    both = np.concatenate([x["paper"][:, :-1], x["position"][:, 9:]], axis=1)
    assert x["combined"] == pytest.approx(both)
