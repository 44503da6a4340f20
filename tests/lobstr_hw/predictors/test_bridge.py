"""A point that comes back: the state is as if it had never been quite lost."""

import io
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.even_motion import even_motion, out_of_sight
from support.stepping import moved, run

from lobstr_hw.predictors import Predictor, State, bridge, load_predictor
from lobstr_hw.predictors.gap_memory import FRAMES
from lobstr_hw.rotations import geodesic_angle, rotation_y
from lobstr_hw.skeleton import Body
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

LOST_AT = 20
PELVIS, HEAD = TrackerRole.PELVIS, TrackerRole.HEAD
LEFT, RIGHT = TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND


@pytest.fixture(scope="module")
def predictor() -> Predictor:
    return load_predictor("lobstr")


def off(a: State, b: State) -> float:
    """How far apart two hidden states are at most."""
    return float(np.abs(a["hidden"] - b["hidden"]).max())


def unbridged(monkeypatch: pytest.MonkeyPatch, call: Callable[[], State]) -> State:
    with monkeypatch.context() as patch:
        patch.setattr(bridge, "bridged", lambda state, *others: state)
        return call()


@pytest.mark.parametrize("role", FOUR_POINTS)
@pytest.mark.parametrize("steps", [1, 45, FRAMES - 1])
def test_what_moved_evenly_while_it_was_lost_leaves_no_trace(
    predictor: Predictor, role: TrackerRole, steps: int
) -> None:
    taken = even_motion(LOST_AT + steps + 1, role)
    state, said = run(predictor, taken)
    again, other = run(predictor, out_of_sight(taken, role, LOST_AT, LOST_AT + steps))
    assert off(state, again) < 1e-4
    assert geodesic_angle(said[-1].R, other[-1].R).max() < 1e-4
    for name in ("p", "R", "R_ref"):
        assert again[name] == pytest.approx(state[name], abs=1e-9)
    meanwhile = [geodesic_angle(a.R, b.R).max() for a, b in zip(said, other, strict=True)]
    assert max(meanwhile) > 3e-4, "it was lost"


@pytest.mark.parametrize(
    ("left", "right"), [((20, 60), (40, 80)), ((20, 80), (30, 60)), ((20, 70), (45, 70))]
)
def test_gaps_that_overlap_are_each_filled(
    predictor: Predictor, left: tuple[int, int], right: tuple[int, int]
) -> None:
    taken = even_motion(81, HEAD)
    lost = out_of_sight(out_of_sight(taken, LEFT, *left), RIGHT, *right)
    assert off(run(predictor, taken)[0], run(predictor, lost)[0]) < 1e-4


def test_a_hand_that_is_long_lost_does_not_keep_the_pelvis_from_being_bridged(
    predictor: Predictor, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken = out_of_sight(even_motion(220, LEFT), LEFT, LOST_AT, 220)
    lost = out_of_sight(taken, PELVIS, 170, 215)
    whole, again = run(predictor, taken)[0], run(predictor, lost)[0]
    never = unbridged(monkeypatch, lambda: run(predictor, lost)[0])
    assert off(whole, again) < 0.5 * off(whole, never)


def test_people_side_by_side_are_the_same_as_one_by_one(predictor: Predictor) -> None:
    taken = even_motion(100, PELVIS, n=4)
    gaps = [(0, PELVIS, 20, 60), (1, PELVIS, 35, 60), (1, LEFT, 50, 90), (2, HEAD, 40, 98)]
    for who, role, first, end in gaps:
        taken = out_of_sight(taken, role, first, end, who)
    together, said = run(predictor, taken)
    for k in range(4):
        one = [
            replace(f, **{name: getattr(f, name)[[k]] for name in ("p", "R", "valid_p", "valid_R")})
            for f in taken
        ]
        alone, said_alone = run(predictor, one)
        assert geodesic_angle(said[-1].R[k], said_alone[-1].R[0]).max() < 1e-4
        for name, value in alone.items():
            np.testing.assert_allclose(together[name][k], value[0], atol=1e-4, err_msg=name)


def test_a_play_space_that_moves_in_mid_gap_makes_no_difference(predictor: Predictor) -> None:
    taken = out_of_sight(even_motion(70, PELVIS), PELVIS, LOST_AT, 65)
    T = np.eye(4)[None].copy()
    T[0, :3, :3], T[0, :3, 3] = rotation_y(1.3), [2.0, 0.0, -1.0]
    state, _ = run(predictor, taken[:40])
    straight, _ = run(predictor, taken[40:], state)
    there, _ = run(predictor, [moved(f, T) for f in taken[40:]], predictor.shift_world(state, T))
    assert off(straight, there) < 1e-4
    left_behind = {**predictor.shift_world(state, T), **{k: state[k] for k in state if "gap" in k}}
    assert off(straight, run(predictor, [moved(f, T) for f in taken[40:]], left_behind)[0]) > 1e-3


def test_a_state_that_is_saved_in_mid_gap_goes_on_alike(predictor: Predictor) -> None:
    taken = out_of_sight(even_motion(70, PELVIS), PELVIS, LOST_AT, 65)
    state, _ = run(predictor, taken[:40])
    file = io.BytesIO()
    np.savez(file, **state)  # type: ignore[arg-type]  # numpy has no types for names by **
    file.seek(0)
    with np.load(file) as saved:
        read = {name: saved[name] for name in saved.files}
    (a, said), (b, other) = run(predictor, taken[40:], state), run(predictor, taken[40:], read)
    assert all((a[name] == b[name]).all() for name in a)
    assert (said[-1].R == other[-1].R).all()


def test_a_step_is_pure_whatever_comes_back(predictor: Predictor) -> None:
    taken = out_of_sight(even_motion(60, PELVIS), PELVIS, LOST_AT, 50)
    taken = out_of_sight(taken, RIGHT, 30, 60)
    state = predictor.start(Body.standard())
    for frame in taken:
        kept = {name: value.copy() for name, value in state.items()}
        new, _ = predictor.step(state, frame)
        assert all((state[name] == kept[name]).all() for name in kept)
        state = new


@pytest.mark.parametrize("steps", [FRAMES - 1, FRAMES, 2 * FRAMES + 3])
def test_a_gap_that_is_too_long_is_not_bridged(
    predictor: Predictor, monkeypatch: pytest.MonkeyPatch, steps: int
) -> None:
    taken = even_motion(LOST_AT + steps + 5, PELVIS)
    lost = out_of_sight(taken, PELVIS, LOST_AT, LOST_AT + steps)
    never = unbridged(monkeypatch, lambda: run(predictor, lost)[0])
    apart = off(never, run(predictor, lost)[0])
    assert (apart > 1e-3) if steps < FRAMES else (apart == 0.0)


@pytest.mark.parametrize("stall", [35, 50])
def test_nothing_is_bridged_over_a_time_that_nobody_saw(
    predictor: Predictor, monkeypatch: pytest.MonkeyPatch, stall: int
) -> None:
    lost = out_of_sight(even_motion(60, PELVIS), PELVIS, LOST_AT, 50)
    lost[stall:] = [replace(frame, time_s=frame.time_s + 3.0) for frame in lost[stall:]]
    never = unbridged(monkeypatch, lambda: run(predictor, lost)[0])
    assert off(never, run(predictor, lost)[0]) == 0.0


def test_a_position_that_is_measured_all_along_stays_when_only_the_rotation_was_lost(
    predictor: Predictor,
) -> None:
    taken = even_motion(61, PELVIS)
    sway = [0.03 * np.sin(0.4 * i) * np.array([1.0, 0.0, 0.0]) for i in range(61)]
    taken = [replace(f, p=f.p + by) for f, by in zip(taken, sway, strict=True)]
    lost = out_of_sight(taken, PELVIS, LOST_AT, 60)
    lost = [replace(f, p=true.p, valid_p=true.valid_p) for f, true in zip(lost, taken, strict=True)]
    assert off(run(predictor, taken)[0], run(predictor, lost)[0]) < 1e-4


def test_a_position_and_a_rotation_that_are_lost_at_different_times_leave_no_trace(
    predictor: Predictor,
) -> None:
    taken = even_motion(61, PELVIS)
    whole, late = (out_of_sight(taken, PELVIS, first, 60) for first in (LOST_AT, 40))
    lost = [replace(a, p=b.p, valid_p=b.valid_p) for a, b in zip(whole, late, strict=True)]
    assert off(run(predictor, taken)[0], run(predictor, lost)[0]) < 1e-4


def test_a_pelvis_that_is_long_lost_still_goes_with_the_head(predictor: Predictor) -> None:
    still = even_motion(1, PELVIS)[0]
    taken = [
        replace(still, time_s=i / 45.0, p=still.p + i * np.array([0.01, 0.0, 0.02]))
        for i in range(LOST_AT + 2 * FRAMES)
    ]
    state, _ = run(predictor, taken)
    again, _ = run(predictor, out_of_sight(taken, PELVIS, LOST_AT, len(taken)))
    assert again["p"] == pytest.approx(state["p"])


def test_where_nothing_is_lost_nothing_is_copied(predictor: Predictor) -> None:
    taken = even_motion(10, PELVIS)
    state, _ = run(predictor, taken[:9])
    after, _ = predictor.step(state, taken[9])
    assert after["kept"] is state["kept"]
    assert all(after[name] is state[name] for name in state if "gap" in name)


def test_a_point_that_was_never_seen_is_where_the_frame_has_it(predictor: Predictor) -> None:
    taken = even_motion(30, PELVIS)
    gone = [replace(f, valid_p=f.valid_p & False, valid_R=f.valid_R & False) for f in taken]
    state, _ = run(predictor, gone)
    order = [FOUR_POINTS.index(r) for r in (PELVIS, HEAD, LEFT, RIGHT)]
    assert (state["p"] == taken[-1].p[:, order]).all()
