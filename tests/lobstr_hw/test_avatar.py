"""Laws of Avatar.step, on a made walk and a predictor without a network."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from support.fake_predictor import FakePredictor
from support.upper_bodies import frame_of, random_bodies, walk

from lobstr_hw.avatar import Avatar
from lobstr_hw.contact import LockSettings
from lobstr_hw.errors import ModelError
from lobstr_hw.predictors.predictor import Frame, Prediction, State
from lobstr_hw.rotations import (
    Array,
    from_rotation_vector,
    geodesic_angle,
    heading,
    rotation_y,
    slerp,
)
from lobstr_hw.skeleton import (
    HEEL,
    PARENTS,
    STANDARD_OFFSETS,
    TOE_TIP,
    Body,
    Joint,
    forward_kinematics,
    global_rotations,
)
from lobstr_hw.skeleton_pose import SkeletonPose, Source
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT, TrackerRole

RATES = [45.0, 60.0, 72.0, 90.0, 144.0]
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]
FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]
SIX_POINTS = (*FOUR_POINTS, TrackerRole.LEFT_FOOT, TrackerRole.RIGHT_FOOT)


def ticks(
    rate_hz: float, duration_s: float, n: int = 1, **how: float
) -> Iterator[tuple[Frame, list[Frame]]]:
    """The frames of a walk and those on the 45 Hz grid due by each tick."""
    ratio, done = Fraction(45) / Fraction(rate_hz), -1
    for k in range(int(duration_s * rate_hz)):
        newest = k * ratio.numerator // ratio.denominator
        due = [j / 45.0 for j in range(done + 1, newest + 1)]
        done = newest
        yield (
            frame_of(*walk(k / rate_hz, n, **how), k / rate_hz),
            [frame_of(*walk(t, n, **how), t) for t in due],
        )


def run(
    avatar: Avatar, rate_hz: float = 45.0, duration_s: float = 1.2, n: int = 1, **how: float
) -> list[tuple[State, SkeletonPose, Frame]]:
    state, out = avatar.start(), []
    for frame, grid in ticks(rate_hz, duration_s, n, **how):
        state, pose = avatar.step(state, frame, grid)
        out.append((state, pose, frame))
    return out


def test_head_hands_and_hips_are_where_they_were_measured() -> None:
    for _, pose, frame in run(Avatar(FakePredictor(), Body.standard())):
        joints = [ROLE_JOINT[role] for role in FOUR_POINTS]
        np.testing.assert_allclose(pose.p_world[:, joints], frame.p, atol=1e-5)
        np.testing.assert_allclose(global_rotations(pose.R_local)[:, joints], frame.R, atol=1e-9)


@pytest.mark.parametrize("hips_m", [0.8, 1.0, 1.2])
def test_bones_keep_the_users_lengths(hips_m: float) -> None:
    body = Body.standard(2, hips_height_m=hips_m)
    lengths = np.linalg.norm(body.offsets[:, 1:], axis=-1)
    for _, pose, _ in run(Avatar(FakePredictor(), body), n=2):
        bones = pose.p_world[:, 1:] - pose.p_world[:, PARENTS[1:]]
        np.testing.assert_allclose(np.linalg.norm(bones, axis=-1), lengths, atol=1e-9)


def test_positions_are_the_fk_of_the_rotations() -> None:
    body = Body.standard(3, hips_height_m=0.9)
    for _, pose, _ in run(Avatar(FakePredictor(), body), duration_s=0.5, n=3):
        p, _ = forward_kinematics(pose.R_local, pose.p_world[:, 0], body.offsets)
        np.testing.assert_allclose(pose.p_world, p, atol=1e-12)


def test_a_big_person_is_the_standard_one_scaled() -> None:
    standard = run(Avatar(FakePredictor(), Body.standard()))
    big = run(Avatar(FakePredictor(), Body.standard(hips_height_m=1.25)))
    for (_, a, _), (_, b, _) in zip(standard, big, strict=True):
        np.testing.assert_allclose(b.p_world, 1.25 * a.p_world, atol=1e-9)
        np.testing.assert_allclose(b.R_local, a.R_local, atol=1e-9)


def test_the_same_walk_twice_gives_the_same_bytes() -> None:
    first = run(Avatar(FakePredictor(), Body.standard(), loop_rate_hz=90.0), 90.0)
    second = run(Avatar(FakePredictor(), Body.standard(), loop_rate_hz=90.0), 90.0)
    for (s, a, _), (t, b, _) in zip(first, second, strict=True):
        assert a.p_world.tobytes() == b.p_world.tobytes()
        assert a.R_local.tobytes() == b.R_local.tobytes()
        assert {k: v.tobytes() for k, v in s.items()} == {k: v.tobytes() for k, v in t.items()}


def test_a_step_leaves_the_state_it_was_given_alone() -> None:
    avatar = Avatar(FakePredictor(), Body.standard())
    state = run(avatar, duration_s=1.0)[-1][0]
    kept = {key: value.copy() for key, value in state.items()}
    frame = frame_of(*walk(1.0), 1.0)
    avatar.step(state, frame, [frame])
    for key, value in kept.items():
        np.testing.assert_array_equal(state[key], value)


def test_a_batch_gives_what_its_members_give_alone() -> None:
    n = 3
    body = Body.standard(n)
    together = run(Avatar(FakePredictor(), body, loop_rate_hz=60.0), 60.0, 0.8, n)
    for i in range(n):
        one = Body(body.offsets[[i]], body.sole[[i]], body.scale[[i]])
        avatar = Avatar(FakePredictor(), one, loop_rate_hz=60.0)
        state = avatar.start()
        for (frame, grid), (_, pose, _) in zip(ticks(60.0, 0.8, n), together, strict=True):
            state, alone = avatar.step(state, only(frame, i), [only(g, i) for g in grid])
            np.testing.assert_allclose(alone.p_world[0], pose.p_world[i], atol=1e-9)
            np.testing.assert_array_equal(alone.locked[0], pose.locked[i])


def only(frame: Frame, i: int) -> Frame:
    return replace(
        frame,
        p=frame.p[[i]],
        R=frame.R[[i]],
        valid_p=frame.valid_p[[i]],
        valid_R=frame.valid_R[[i]],
    )


def moved(frame: Frame, T: Array) -> Frame:
    return replace(frame, p=frame.p @ T[:3, :3].T + T[:3, 3], R=T[:3, :3] @ frame.R)


def test_it_does_not_matter_where_the_room_lies_also_when_it_moves_on_the_way() -> None:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_y(2.2), [3.0, 0.0, -1.5]
    avatar = Avatar(FakePredictor(), Body.standard(), loop_rate_hz=90.0)
    here, there = avatar.start(), avatar.start()
    change = np.eye(4)
    for k, (frame, grid) in enumerate(ticks(90.0, 1.8)):
        held = here["lock.on"][0]
        if k > 60 and change is not T and held.any() and not held.all():
            # one foot is held, the other one swings
            there, change = avatar.shift_world(there, T[None]), T
        here, a = avatar.step(here, frame, grid)
        there, b = avatar.step(there, moved(frame, change), [moved(g, change) for g in grid])
        np.testing.assert_allclose(
            b.p_world, a.p_world @ change[:3, :3].T + change[:3, 3], atol=1e-6
        )
        np.testing.assert_allclose(b.R_local[:, 1:], a.R_local[:, 1:], atol=1e-5)
        np.testing.assert_array_equal(a.locked, b.locked)
    assert change is T


@pytest.mark.parametrize("rate_hz", RATES)
def test_a_locked_foot_stands_still_at_every_rate(rate_hz: float) -> None:
    out = run(Avatar(FakePredictor(), Body.standard(), loop_rate_hz=rate_hz), rate_hz, 2.2)
    locked = np.array([pose.locked[0] for _, pose, _ in out])
    toes = np.array([pose.p_world[0, TOES] for _, pose, _ in out])
    both = locked[1:] & locked[:-1]
    moves = np.abs(np.diff(toes, axis=0))
    assert moves[both][:, [0, 2]].max() < 1e-6
    # up and down it goes with the network's, to the floor and off it, but slowly
    assert moves[both][:, 1].max() < 0.3 / rate_hz + 1e-6
    assert 0.2 < locked.mean() < 0.8, "it walks: each foot is held a good part of the time"


@pytest.mark.parametrize("hips_m", [0.55, 0.85, 1.0, 1.1])
def test_no_point_of_a_sole_goes_under_the_floor(hips_m: float) -> None:
    for _, pose, _ in run(Avatar(FakePredictor(), Body.standard(8)), n=8, hips_m=hips_m):
        R = global_rotations(pose.R_local)
        heel = pose.p_world[:, FEET] + (R[:, FEET] @ HEEL[:, None])[..., 0]
        tip = pose.p_world[:, TOES] + (R[:, TOES] @ TOE_TIP[:, None])[..., 0]
        lowest = min(heel[..., 1].min(), tip[..., 1].min(), pose.p_world[:, TOES, 1].min() - 0.02)
        assert lowest > -1e-4


@pytest.mark.parametrize("moved_at", [None, 30])
def test_hips_and_hands_that_are_lost_go_where_the_body_goes(moved_at: int | None) -> None:
    lost = np.isin(FOUR_POINTS, [TrackerRole.PELVIS, TrackerRole.LEFT_HAND])
    avatar, T = Avatar(FakePredictor(), Body.standard()), np.eye(4)
    joints = [ROLE_JOINT[role] for role in FOUR_POINTS]
    state = avatar.start()
    for k in range(60):
        frame = frame_of(*walk(0.0), k / 45.0)  # a gliding body
        p, R = frame.p + np.array([0.0, 0.0, 0.02 * k]), frame.R
        if k == moved_at:
            T[:3, :3], T[:3, 3] = rotation_y(1.2), [3.0, 0.0, -1.0]
            state = avatar.shift_world(state, T[None])
        p, R = p @ T[:3, :3].T + T[:3, 3], T[:3, :3] @ R
        gone = lost & (20 <= k)
        valid = ~gone[None]
        given = np.where(gone[:, None], 9.0, p), np.where(gone[:, None, None], np.eye(3), R)
        frame = Frame(frame.time_s, FOUR_POINTS, *given, valid, valid)
        state, pose = avatar.step(state, frame, [frame])
        np.testing.assert_allclose(pose.p_world[:, joints], p, atol=1e-5)
        sources = pose.source[0, joints]
        assert ((sources == Source.HELD) == gone).all()


def test_feet_with_trackers_are_never_locked_and_stand_where_they_are_tracked() -> None:
    avatar = Avatar(FakePredictor(roles=SIX_POINTS), Body.standard())
    state = avatar.start()
    for k in range(60):
        p, R = walk(k / 45.0)
        R = R.copy()
        p = p.copy()
        p[:, FEET] += [0.02, 0.15, 0.03]
        frame = frame_of(p, R, k / 45.0, SIX_POINTS)
        state, pose = avatar.step(state, frame, [frame])
        assert not pose.locked.any()
        np.testing.assert_allclose(pose.p_world[:, FEET], p[:, FEET], atol=1e-4)
        assert (pose.source[:, FEET] == Source.TRACKED).all()


def test_a_foot_whose_tracker_is_lost_goes_to_the_networks_and_does_not_jump() -> None:
    avatar = Avatar(FakePredictor(roles=SIX_POINTS, contacts=False), Body.standard())
    state, toes = avatar.start(), []
    for k in range(60):
        p, R = walk(0.0)  # standing
        p, R = p.copy(), R.copy()
        p[:, FEET] += [0.02, 0.15, 0.03]
        frame = frame_of(p, R, k / 45.0, SIX_POINTS)
        if k >= 20:
            frame = replace(frame, valid_p=np.array([[True] * 4 + [False] * 2]))
        state, pose = avatar.step(state, frame, [frame])
        toes.append(pose.p_world[0, TOES])
    steps = np.linalg.norm(np.diff(toes, axis=0), axis=-1)
    way = np.linalg.norm(toes[-1] - toes[19], axis=-1)
    assert way.min() > 0.1
    assert steps[19:].max() < 0.35 * way.min()
    assert steps[50:].max() < 1e-3


def test_the_hips_carry_the_measured_tilt_and_the_legs_the_networks_direction() -> None:
    p, R = random_bodies(np.random.default_rng(1), 50, size=0.2)
    frame = frame_of(p + np.array([0.0, 0.3, 0.0]), R, 0.0)  # in the air: neither lock nor floor
    given: list[Prediction] = []

    class Listening(FakePredictor):
        def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
            state, prediction = super().step(state, frame)
            legs = from_rotation_vector(np.random.default_rng(2).normal(scale=0.2, size=(50, 6, 3)))
            legs[:, [1, 4]] = from_rotation_vector(np.array([0.4, 0.0, 0.0]))
            given.append(replace(prediction, R=legs))
            return state, given[-1]

    avatar = Avatar(Listening(), Body.standard(50))
    _, pose = avatar.step(avatar.start(), frame, [frame])
    R_hips = R[:, Joint.HIPS]
    np.testing.assert_allclose(pose.R_local[:, Joint.HIPS], R_hips)
    for i, joint in ((0, Joint.LEFT_UPPER_LEG), (3, Joint.RIGHT_UPPER_LEG)):
        local = np.swapaxes(R_hips, -1, -2) @ heading(R_hips) @ given[0].R[:, i]
        np.testing.assert_allclose(pose.R_local[:, joint], local, atol=1e-6)
    for i, joint in ((1, Joint.LEFT_LOWER_LEG), (2, Joint.LEFT_FOOT), (5, Joint.RIGHT_FOOT)):
        np.testing.assert_allclose(pose.R_local[:, joint], given[0].R[:, i], atol=1e-6)


def test_ticks_off_the_grid_show_what_lies_half_a_step_beyond_the_slerp_of_two_outputs() -> None:
    # at 90 Hz tick 2 j shows the middle of outputs j - 1 and j, tick 2 j + 1 shows j
    delay_s = 0.01
    rough = LockSettings(smooth_s=1e-6)  # where the smoothed toe is, is the contact lock's business
    slow = Avatar(FakePredictor(contacts=False), Body.standard(), lock=rough)
    fast = Avatar(
        FakePredictor(contacts=False),
        Body.standard(),
        loop_rate_hz=90.0,
        input_delay_s=delay_s,
        lock=rough,
    )
    s, f = slow.start(), fast.start()
    outputs, shown = [], []
    for k in range(60):
        t = 0.5 * k / 45.0
        frame = airborne(t)
        grid = [airborne(t - delay_s)] if k % 2 == 0 else []
        f, pose = fast.step(f, frame, grid)
        shown.append(pose.R_local[0, Joint.LEFT_FOOT])
        if grid:
            s, pose = slow.step(s, frame, grid)
            outputs.append(pose.R_local[0, Joint.LEFT_FOOT])
    assert geodesic_angle(outputs[11], outputs[10]) > 1e-3, "the foot moves"
    for j in range(2, 30):
        middle = slerp(outputs[j - 1], outputs[j], 0.5)
        np.testing.assert_allclose(shown[2 * j], middle, atol=1e-6)
        np.testing.assert_allclose(shown[2 * j + 1], outputs[j], atol=1e-6)


def airborne(time_s: float) -> Frame:
    """Of a walk so high that no foot touches the floor."""
    p, R = walk(time_s)
    return frame_of(p + np.array([0.0, 0.5, 0.0]), R, time_s)


def test_late_grid_steps_are_all_run() -> None:
    avatar = Avatar(FakePredictor(), Body.standard())
    frames = [frame_of(*walk(k / 45.0), k / 45.0) for k in range(9)]
    one_by_one, at_once = avatar.start(), avatar.start()
    for frame in frames:
        one_by_one, _ = avatar.step(one_by_one, frame, [frame])
    for due in (frames[:1], frames[1:5], frames[5:]):
        at_once, _ = avatar.step(at_once, due[-1], due)
    for key in one_by_one:
        if key.startswith(("predictor.", "shown.")):
            np.testing.assert_array_equal(at_once[key], one_by_one[key])


def test_every_joint_says_where_it_comes_from() -> None:
    avatar = Avatar(FakePredictor(), Body.standard())
    frame = frame_of(*walk(0.0), 0.0)
    state, before = avatar.step(avatar.start(), frame, [])
    assert before.source[0, Joint.LEFT_UPPER_LEG] == Source.HELD
    lost = replace(frame, valid_p=np.array([[True, False, True, True]]))
    _, pose = avatar.step(state, lost, [lost])
    of = dict(zip(Joint, pose.source[0], strict=True))
    assert of[Joint.HIPS] == of[Joint.HEAD] == of[Joint.RIGHT_HAND] == Source.TRACKED
    assert of[Joint.LEFT_HAND] == Source.HELD
    assert of[Joint.CHEST] == of[Joint.LEFT_LOWER_ARM] == of[Joint.LEFT_TOES] == Source.IK
    assert of[Joint.LEFT_UPPER_LEG] == of[Joint.RIGHT_FOOT] == Source.PREDICTED
    assert pose.roles[TrackerRole.LEFT_HAND].state == "guessed"
    assert pose.roles[TrackerRole.HEAD].state == "ok"


def test_lying_upside_down_keeps_the_last_heading() -> None:
    avatar = Avatar(FakePredictor(), Body.standard())
    frame = frame_of(*walk(0.0, yaw=0.8), 0.0)
    state, _ = avatar.step(avatar.start(), frame, [frame])
    turned = from_rotation_vector(np.array([np.pi, 0.0, 0.0])) @ frame.R
    upside_down = replace(frame, R=turned, time_s=1 / 45)
    after, pose = avatar.step(state, upside_down, [upside_down])
    np.testing.assert_allclose(after["avatar.R_ref"], state["avatar.R_ref"])
    assert np.isfinite(pose.p_world).all()


def test_standing_still_for_a_minute_changes_nothing() -> None:
    avatar = Avatar(FakePredictor(), Body.standard())
    state, poses = avatar.start(), []
    for k in range(0, 45 * 60, 45):
        frame = frame_of(*walk(0.0), k / 45.0)
        state, pose = avatar.step(state, frame, [frame])
        poses.append(pose.p_world)
    np.testing.assert_allclose(poses[-1], poses[2], atol=1e-9)


def test_a_predictor_without_legs_is_refused_by_name() -> None:
    class Armless(FakePredictor):
        @property
        def card(self):  # type: ignore[no-untyped-def]
            return replace(super().card, gives=(Joint.LEFT_UPPER_LEG,))

    with pytest.raises(ModelError, match="right_upper_leg"):
        Avatar(Armless(), Body.standard())


def test_a_predictor_that_lags_is_refused_by_name() -> None:
    with pytest.raises(ModelError, match="3 steps ago"):
        Avatar(FakePredictor(delay_frames=3), Body.standard())


def test_the_standard_foot_is_assumed_above() -> None:
    np.testing.assert_allclose(STANDARD_OFFSETS[Joint.LEFT_TOES], [0.0, -0.043, 0.120])


def test_nonsense_from_the_trackers_still_gives_a_body() -> None:
    rng, n = np.random.default_rng(41), 100
    avatar = Avatar(FakePredictor(), Body.standard(n))
    state, valid = avatar.start(), np.ones((n, 4), dtype=bool)
    lengths = np.linalg.norm(STANDARD_OFFSETS[1:], axis=-1)
    half_turns = np.array([np.diag(d) for d in ([1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])])
    for k in range(15):
        p = rng.normal(size=(n, 4, 3)) * rng.choice([0.0, 0.01, 0.3, 100.0], size=(n, 1, 1))
        R = from_rotation_vector(
            rng.normal(size=(n, 4, 3)) * rng.choice([0.0, 1.0], size=(n, 1, 1))
        )
        R[:3] = half_turns[:, None]
        frame = Frame(k / 45.0, FOUR_POINTS, p, R, valid, valid)
        state, pose = avatar.step(state, frame, [frame])
        bones = pose.p_world[:, 1:] - pose.p_world[:, PARENTS[1:]]
        np.testing.assert_allclose(
            np.linalg.norm(bones, axis=-1), np.tile(lengths, (n, 1)), atol=1e-6
        )
        identity = np.broadcast_to(np.eye(3), (n, 22, 3, 3))
        np.testing.assert_allclose(
            pose.R_local @ np.swapaxes(pose.R_local, -1, -2), identity, atol=1e-6
        )
