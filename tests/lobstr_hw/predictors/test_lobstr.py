"""Laws of the network as a predictor."""

from collections.abc import Sequence

import numpy as np
import pytest
from support.motions import walking
from support.stepping import moved, run

from lobstr_hw.motion import Motion
from lobstr_hw.predictors import Frame, Predictor, load_predictor
from lobstr_hw.predictors.lobstr import softmax_contact
from lobstr_hw.rotations import Array, geodesic_angle, rotation_y
from lobstr_hw.skeleton import Joint
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT, TrackerRole


@pytest.fixture(scope="module")
def predictor() -> Predictor:
    return load_predictor("lobstr")


def frames(motions: Sequence[Motion], roles: tuple[TrackerRole, ...] = FOUR_POINTS) -> list[Frame]:
    """The motions side by side."""
    joints = [ROLE_JOINT[role] for role in roles]
    poses = [motion.joints() for motion in motions]
    p = np.stack([pose[0][:, joints] for pose in poses], axis=1)
    R = np.stack([pose[1][:, joints] for pose in poses], axis=1)
    ok = np.ones(p.shape[1:3], dtype=bool)
    return [Frame(i / 45.0, roles, p[i], R[i], ok, ok) for i in range(len(p))]


def play_space_move() -> Array:
    T = np.eye(4)[None].copy()
    T[0, :3, :3] = rotation_y(1.3)
    T[0, :3, 3] = [2.0, 0.0, -1.0]
    return T


def test_the_card_says_what_it_gives(predictor: Predictor) -> None:
    card = predictor.card
    assert card.rate_hz == 45.0
    assert set(card.needs) == set(FOUR_POINTS)
    assert [joint.name for joint in card.gives] == [
        f"{side}_{bone}"
        for side in ("LEFT", "RIGHT")
        for bone in ("UPPER_LEG", "LOWER_LEG", "FOOT")
    ]


def test_it_gives_rotations_and_probabilities(predictor: Predictor) -> None:
    _, said = run(predictor, frames([walking(1.0)]))
    for prediction in said:
        assert prediction.C is not None
        for R in (prediction.R, prediction.C):
            assert R @ np.swapaxes(R, -1, -2) == pytest.approx(
                np.broadcast_to(np.eye(3), R.shape), abs=1e-9
            )
            assert np.linalg.det(R) == pytest.approx(1.0)
        assert ((prediction.contact > 0.0) & (prediction.contact < 1.0)).all()


def test_a_step_is_pure(predictor: Predictor) -> None:
    sequence = frames([walking(0.5)])
    state, _ = run(predictor, sequence[:10])
    kept = {key: value.copy() for key, value in state.items()}
    first, second = (predictor.step(state, sequence[10]) for _ in range(2))
    assert all((state[key] == kept[key]).all() for key in kept)
    assert all((first[0][key] == second[0][key]).all() for key in kept)
    assert (first[1].R == second[1].R).all()


def test_many_people_at_once_are_the_same_as_one_by_one(predictor: Predictor) -> None:
    walks = [walking(0.5, seed=seed, turn_rad_s=0.3 * seed) for seed in range(3)]
    _, together = run(predictor, frames(walks))
    for k, walk in enumerate(walks):
        _, alone = run(predictor, frames([walk]))
        assert together[-1].R[k] == pytest.approx(alone[-1].R[0], abs=1e-4)
        assert together[-1].contact[k] == pytest.approx(alone[-1].contact[0], abs=1e-4)


def test_the_order_of_the_roles_does_not_matter(predictor: Predictor) -> None:
    walk = walking(0.5)
    _, said = run(predictor, frames([walk]))
    _, other = run(predictor, frames([walk], FOUR_POINTS[::-1]))
    assert said[-1].R == pytest.approx(other[-1].R)


def test_the_legs_do_not_depend_on_where_the_world_points(predictor: Predictor) -> None:
    sequence, T = frames([walking(1.0)]), play_space_move()
    _, said = run(predictor, sequence)
    _, other = run(predictor, [moved(frame, T) for frame in sequence])
    assert geodesic_angle(said[-1].R, other[-1].R).max() < 1e-4


def test_a_moved_play_space_makes_no_jump(predictor: Predictor) -> None:
    sequence, T = frames([walking(1.0)]), play_space_move()
    state, _ = run(predictor, sequence[:20])
    _, said = run(predictor, sequence[20:], state)
    shifted = predictor.shift_world(state, T)
    _, other = run(predictor, [moved(frame, T) for frame in sequence[20:]], shifted)
    for a, b in zip(said, other, strict=True):
        assert geodesic_angle(a.R, b.R).max() < 1e-4
    _, jump = run(predictor, [moved(frame, T) for frame in sequence[20:]], state)
    assert geodesic_angle(said[0].R, jump[0].R).max() > 1e-3


def test_a_gap_in_time_is_no_movement(predictor: Predictor) -> None:
    """A metre gone while nobody looked is not a metre in a 45th of a second."""
    sequence = frames([walking(1.0)])
    state, _ = run(predictor, sequence[:20])
    far = moved(sequence[20], play_space_move())
    later = Frame(far.time_s + 5.0, far.roles, far.p, far.R, far.valid_p, far.valid_R)
    here = sequence[20]
    still = Frame(here.time_s + 5.0, here.roles, here.p, here.R, here.valid_p, here.valid_R)
    assert predictor.step(state, later)[1].R == pytest.approx(
        predictor.step(state, still)[1].R, abs=1e-6
    )


def test_upper_legs_are_given_under_their_hip_joints(predictor: Predictor) -> None:
    """R is C U: what stands in the reference frame needs no C to be shown."""
    _, said = run(predictor, frames([walking(0.2)]))
    prediction = said[-1]
    assert prediction.C is not None
    upper = predictor.card.gives.index(Joint.RIGHT_UPPER_LEG)
    U = np.swapaxes(prediction.C[0, 1], -1, -2) @ prediction.R[0, upper]
    assert np.linalg.det(U) == pytest.approx(1.0)


def test_the_probability_is_a_softmax_and_does_not_overflow() -> None:
    logits = np.array([[0.0, 2.0, 3.0, -1.0], [0.0, 1e4, 1e4, 0.0]], dtype=np.float32)
    on = softmax_contact(logits)
    expected = np.exp([2.0, -1.0]) / (np.exp([0.0, 3.0]) + np.exp([2.0, -1.0]))
    assert on[0] == pytest.approx(expected)
    assert on[1] == pytest.approx([1.0, 0.0])
