"""Two tracking spaces from one movement."""

import numpy as np
import pytest
from support.two_spaces import Scene, held_together

from lobstr_hw.calibration.alike import ALIKE, most_alike, turning_likeness
from lobstr_hw.calibration.hand_eye import fit_positions, fit_rotations, wobble
from lobstr_hw.calibration.spaces import (
    LEAST_S,
    LEAST_WOBBLE_RAD,
    SpaceAlignment,
    align_spaces,
    turned_so_far,
)
from lobstr_hw.calibration.track import Track
from lobstr_hw.calibration.verdict import Grade
from lobstr_hw.errors import SpacesNotJoined
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle, rotation_y
from lobstr_hw.simulation import TrackingErrors
from lobstr_hw.simulation.noise import random_rotations

ONE_AXIS = np.array([0.0, 1.0, 0.0])


def aligned(scene: Scene) -> SpaceAlignment:
    return align_spaces(scene.samples_a, scene.samples_b)


def off_where_it_was(found: Pose, scene: Scene) -> float:
    """How far a tracker of space b would be misplaced where the movement was."""
    p_b = scene.T_a_b.inverse().apply(scene.p_mean)
    return float(np.linalg.norm(found.apply(p_b) - scene.p_mean))


def off_deg(a: Array, b: Array) -> float:
    return float(np.rad2deg(geodesic_angle(a, b)))


@pytest.mark.parametrize("delay_s", [0.0, 0.0043, -0.07])
def test_clean_data_give_the_exact_answer(delay_s: float) -> None:
    for seed in range(2):
        scene = held_together(seed, delay_s=delay_s)
        found = aligned(scene)
        np.testing.assert_allclose(found.T_a_b.R, scene.T_a_b.R, atol=1e-6)
        np.testing.assert_allclose(found.T_a_b.p, scene.T_a_b.p, atol=1e-6)
        held = found.T_trackera_trackerb
        np.testing.assert_allclose(held.R, scene.T_held.R, atol=1e-6)
        np.testing.assert_allclose(held.p, scene.T_held.p, atol=1e-6)
        assert found.delay_s == pytest.approx(delay_s, abs=1e-6)
        assert found.grade is Grade.GOOD


def test_exchanging_the_two_gives_the_inverse() -> None:
    scene = held_together(7, delay_s=0.01)
    there, back = aligned(scene), align_spaces(scene.samples_b, scene.samples_a)
    both = there.T_a_b @ back.T_a_b
    np.testing.assert_allclose(both.R, np.eye(3), atol=1e-6)
    np.testing.assert_allclose(both.p, 0.0, atol=1e-6)
    assert back.delay_s == pytest.approx(-there.delay_s, abs=1e-6)


def test_where_the_world_is_does_not_matter() -> None:
    scene = held_together(8)
    T_world_a = Pose(rotation_y(0.7), np.array([1.0, 0.0, -3.0]))
    space = aligned(scene).space(T_world_a)
    expected = T_world_a @ scene.T_a_b
    np.testing.assert_allclose(space.T_world_space.p, expected.p, atol=1e-6)
    np.testing.assert_allclose(space.T_world_space.R, expected.R, atol=1e-6)


@pytest.mark.parametrize("rate_b_hz", [30.0, 60.0, 240.0])
def test_the_two_may_have_different_rates(rate_b_hz: float) -> None:
    scene = held_together(3, rate_b_hz=rate_b_hz, delay_s=0.02)
    found = aligned(scene)
    # what a straight line between two samples at 30 Hz leaves out
    assert off_where_it_was(found.T_a_b, scene) < 1e-3
    assert off_deg(found.T_a_b.R, scene.T_a_b.R) < 0.1
    assert found.delay_s == pytest.approx(0.02, abs=5e-4)


def test_what_lighthouses_get_wrong_costs_millimetres() -> None:
    scenes = [held_together(seed, delay_s=0.005, errors=TrackingErrors()) for seed in range(8)]
    found = [aligned(scene) for scene in scenes]
    pairs = list(zip(found, scenes, strict=True))
    off_m = [off_where_it_was(f.T_a_b, scene) for f, scene in pairs]
    turned = [off_deg(f.T_a_b.R, scene.T_a_b.R) for f, scene in pairs]
    # two drifts of 2 mm along each axis: nobody can tell them from where the space is
    assert np.median(off_m) < 0.005
    assert np.max(off_m) < 0.012
    assert np.max(turned) < 0.5
    assert np.max([abs(f.delay_s - 0.005) for f in found]) < 0.001
    assert all(f.grade is Grade.GOOD for f in found)


def test_the_least_movement_that_is_taken_is_enough() -> None:
    scenes = [held_together(s, turn_rad=0.25, errors=TrackingErrors()) for s in range(8)]
    assert all(turned_so_far(s.samples_a) < 1.5 * LEAST_WOBBLE_RAD for s in scenes)
    taken = [s for s in scenes if turned_so_far(s.samples_a) > LEAST_WOBBLE_RAD]
    assert len(taken) > 3
    for scene in taken:
        found = aligned(scene)
        assert off_deg(found.T_a_b.R, scene.T_a_b.R) < 0.5
        assert off_where_it_was(found.T_a_b, scene) < 0.015


@pytest.mark.parametrize("turn_rad", [0.0, 0.05, 0.2, 1.0])
def test_turning_about_one_axis_is_refused_with_the_reason(turn_rad: float) -> None:
    scene = held_together(2, turn_rad=turn_rad, axes=ONE_AXIS, errors=TrackingErrors())
    with pytest.raises(SpacesNotJoined, match=r"turned by \d+ degrees .* 15 are needed"):
        aligned(scene)


def test_too_short_a_movement_is_refused() -> None:
    with pytest.raises(SpacesNotJoined, match=r"seen for 2\.\d s, 3 are needed"):
        aligned(held_together(2, seconds=3.0, turn_rad=1.0, delay_s=0.9))


def test_a_tracker_that_was_never_seen_is_told() -> None:
    scene = held_together(2)
    with pytest.raises(SpacesNotJoined, match="720 and 0 samples"):
        align_spaces(scene.samples_a, [])


def test_a_tracker_that_was_left_lying_is_told() -> None:
    moved, lying = held_together(2), held_together(3, turn_rad=0.0)
    with pytest.raises(SpacesNotJoined, match="turned by 0 degrees"):
        align_spaces(moved.samples_a, lying.samples_b)


@pytest.mark.parametrize("seed", range(3))
def test_trackers_that_move_against_each_other_are_refused(seed: int) -> None:
    with pytest.raises(SpacesNotJoined, match="do not move as one"):
        aligned(held_together(seed, slip_m=0.05))


@pytest.mark.parametrize("seed", range(3))
def test_a_little_slipping_is_seen_in_the_grade(seed: int) -> None:
    found = aligned(held_together(seed, slip_m=0.008))
    assert found.grade is Grade.FAIR
    assert 0.003 < found.residual_m < 0.03


def test_the_wobble_is_the_angle_out_of_the_main_axis() -> None:
    t = np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)
    about_y = from_rotation_vector(np.outer(np.sin(t), ONE_AXIS))
    assert wobble(about_y) == pytest.approx(0.0, abs=1e-6)
    small = 0.05 * np.stack([np.sin(3 * t), 10.0 * np.sin(t), np.zeros_like(t)], axis=-1)
    assert wobble(from_rotation_vector(small)) == pytest.approx(0.05 / np.sqrt(2.0), rel=0.1)


def test_the_fits_are_exact_for_any_rotations() -> None:
    rng = np.random.default_rng(0)
    R = random_rotations(rng, 12)
    R_X, R_Y, R_a = R[0], R[1], R[2:]
    R_b = R_X.T @ R_a @ R_Y
    found_X, found_Y = fit_rotations(R_a, R_b)
    np.testing.assert_allclose(found_X, R_X, atol=1e-12)
    np.testing.assert_allclose(found_Y, R_Y, atol=1e-12)
    p_X, p_Y = rng.normal(size=(2, 3))
    p_a = rng.normal(size=(10, 3))
    got_X, got_Y = fit_positions(R_a, p_a, p_a + R_a @ p_Y - p_X)
    np.testing.assert_allclose(got_X, p_X, atol=1e-12)
    np.testing.assert_allclose(got_Y, p_Y, atol=1e-12)


# which trackers are held together


def track(scene: Scene, of: str) -> Track:
    return Track.of(scene.samples_a if of == "a" else scene.samples_b)


@pytest.mark.parametrize("seed", range(3))
def test_the_two_that_are_held_together_are_found_among_others(seed: int) -> None:
    held, others = held_together(seed, delay_s=0.03), held_together(seed + 50)
    of_a = {"other": track(others, "a"), "held": track(held, "a")}
    of_b = {"held": track(held, "b"), "another": track(held_together(seed + 90), "b")}
    found = most_alike(of_a, of_b, LEAST_S, LEAST_WOBBLE_RAD)
    assert found is not None
    assert found[:2] == ("held", "held")
    assert found[2] > ALIKE > turning_likeness(of_a["other"], of_b["held"])[1]
    delay_s, likeness = turning_likeness(of_a["held"], of_b["held"])
    assert delay_s == pytest.approx(0.03, abs=0.011)
    assert likeness == found[2]


def test_what_rests_or_was_hardly_seen_is_like_nothing() -> None:
    moved, rests = held_together(2), held_together(2, turn_rad=0.0)
    short = held_together(2, seconds=1.5)
    of_b = {"b": track(moved, "b")}
    for scene in (rests, short):
        assert most_alike({"a": track(scene, "a")}, of_b, LEAST_S, LEAST_WOBBLE_RAD) is None
    assert turning_likeness(track(rests, "a"), track(moved, "b"))[1] == pytest.approx(0.0, abs=0.5)
    assert most_alike({"a": Track.of([])}, of_b, LEAST_S, LEAST_WOBBLE_RAD) is None
