"""Refined recordings: two-way where it can see, live elsewhere, and nothing jumps in between."""

from dataclasses import replace

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.avatar import Avatar
from lobstr_hw.lower_body import toes_in_reference
from lobstr_hw.predictors import Frame, Predictor, load_predictor
from lobstr_hw.predictors.lobstr import Lobstr
from lobstr_hw.predictors.refined import BLEND_S, TWO_WAY_SHARE, clear_stretches, refined
from lobstr_hw.predictors.two_way import TwoWay, load_two_way
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT

RATE_HZ = 45.0
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]


@pytest.fixture(scope="module")
def live() -> Lobstr:
    predictor = load_predictor("lobstr")
    assert isinstance(predictor, Lobstr)
    return predictor


@pytest.fixture(scope="module")
def two_way() -> TwoWay:
    return load_two_way()


def frames(duration_s: float, seed: int = 1) -> list[Frame]:
    p, R = walking(duration_s, seed=seed).joints()
    joints = [ROLE_JOINT[role] for role in FOUR_POINTS]
    valid = np.ones((1, 4), dtype=bool)
    return [
        Frame(i / RATE_HZ, FOUR_POINTS, p[[i]][:, joints], R[[i]][:, joints], valid, valid)
        for i in range(len(p))
    ]


def lost(taken: list[Frame], first: int, end: int) -> list[Frame]:
    """The same with the pelvis out of sight and held, as the live program does."""
    valid = np.array([[role.value != "pelvis" for role in FOUR_POINTS]])
    at = FOUR_POINTS.index(next(role for role in FOUR_POINTS if role.value == "pelvis"))
    out = list(taken)
    for i in range(first, end):
        p, R = taken[i].p.copy(), taken[i].R.copy()
        p[:, at], R[:, at] = taken[first - 1].p[:, at], taken[first - 1].R[:, at]
        out[i] = replace(taken[i], p=p, R=R, valid_p=valid, valid_R=valid)
    return out


def said_toes(predictor: Predictor, taken: list[Frame]) -> Array:
    """In the reference frame (frames, 2, 3)."""
    state = predictor.start(Body.standard())
    out = []
    for frame in taken:
        state, said = predictor.step(state, frame)
        assert said.C is not None
        legs = said.R.reshape(1, 2, 3, 3, 3)
        U = np.swapaxes(said.C, -1, -2) @ legs[:, :, 0]
        joints = np.concatenate([said.C[:, :, None], U[:, :, None], legs[:, :, 1:]], axis=2)
        out.append(toes_in_reference(joints)[0])
    return np.array(out)


def shown_toes(predictor: Predictor, taken: list[Frame]) -> Array:
    avatar = Avatar(predictor, Body.standard())
    state = avatar.start()
    out = []
    for frame in taken:
        state, pose = avatar.step(state, frame, (frame,))
        out.append(pose.p_world[0, TOES])
    return np.array(out)


def test_the_mean_of_both_is_said_from_the_first_frame_on(
    live: Lobstr, two_way: TwoWay, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken = frames(6.0)
    as_live = said_toes(live, taken)
    mean = said_toes(refined(taken, live, two_way), taken)
    monkeypatch.setattr("lobstr_hw.predictors.refined.TWO_WAY_SHARE", 1.0)
    alone = said_toes(refined(taken, live, two_way), taken)
    expected = TWO_WAY_SHARE * alone + (1.0 - TWO_WAY_SHARE) * as_live
    off = np.linalg.norm(mean - as_live, axis=-1)
    # the mean of rotations is nearly that of the toes
    wrong = np.linalg.norm(mean - expected, axis=-1)
    assert wrong.max() < 0.1 * off.max()
    assert wrong[0].max() < 0.1 * off[0].max(), "nothing was shown before that it could jump from"


def test_after_a_loss_it_goes_over_to_the_mean_of_both_bit_by_bit(
    live: Lobstr, two_way: TwoWay
) -> None:
    taken = lost(frames(8.0), 60, 160)
    as_live, mean = (said_toes(p, taken) for p in (live, refined(taken, live, two_way)))
    inside = 160 + round(BLEND_S * RATE_HZ) + 1
    off = np.linalg.norm(mean - as_live, axis=-1).max(axis=-1)
    np.testing.assert_allclose(mean[160], as_live[160], atol=1e-5)
    assert off[inside:].max() > 0.01
    steps = np.linalg.norm(np.diff((mean - as_live)[160:inside], axis=0), axis=-1)
    assert steps.max() < 0.3 * off[160:].max()


def test_a_long_loss_is_left_to_the_live_network_and_a_short_one_is_not(
    live: Lobstr, two_way: TwoWay
) -> None:
    taken = lost(lost(frames(14.0), 150, 170), 300, 450)
    better, as_live = (said_toes(p, taken) for p in (refined(taken, live, two_way), live))
    off = np.linalg.norm(better - as_live, axis=-1).max(axis=-1)
    assert off[150:170].max() > 1e-3
    assert off[300:450].max() < 1e-4
    assert off[460:].max() > 0.01


def test_where_it_begins_and_ends_the_shown_feet_jump_no_further_than_live(
    live: Lobstr, two_way: TwoWay
) -> None:
    taken = lost(frames(9.0), 170, 260)
    better, as_live = (shown_toes(p, taken) for p in (refined(taken, live, two_way), live))
    jumps, live_jumps = (np.linalg.norm(np.diff(t, axis=0), axis=-1) for t in (better, as_live))
    assert jumps.max() < 1.1 * live_jumps.max()
    for edge in (slice(0, 30), slice(140, 169), slice(170, 200), slice(262, 300)):
        assert jumps[edge].max() < 1.25 * live_jumps[edge].max()


def test_a_gap_is_never_looked_across(live: Lobstr, two_way: TwoWay) -> None:
    """What comes after half a second of nothing does not change what was before."""
    taken = frames(12.0)
    parted = taken[:270] + taken[300:]
    other = taken[:270] + taken[400:]
    before = [said_toes(refined(t, live, two_way), t)[:270] for t in (parted, other)]
    np.testing.assert_array_equal(before[0], before[1])


def test_stretches_are_what_is_clear_and_long_enough() -> None:
    valid = np.ones((900, 4), dtype=bool)
    linked = np.ones(900, dtype=bool)
    linked[0] = linked[500] = linked[540] = False
    valid[200:260, 0] = False  # 1.3 s without a pelvis: bridged
    valid[300:400, 0] = False  # 2.2 s: not
    valid[600:800, 2] = False  # a hand is no matter
    assert list(clear_stretches(valid, linked, RATE_HZ)) == [(0, 300), (400, 500), (540, 900)]


def test_nothing_clear_is_live_throughout(live: Lobstr, two_way: TwoWay) -> None:
    taken = lost(frames(5.0), 40, 190)
    said = [said_toes(p, taken) for p in (refined(taken, live, two_way), live)]
    np.testing.assert_allclose(said[0], said[1], atol=1e-5)


def test_without_frames_there_is_nothing_to_refine(live: Lobstr, two_way: TwoWay) -> None:
    with pytest.raises(ValueError, match="without frames"):
        refined([], live, two_way)
