"""Laws of the metrics."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.evaluation.metrics import Legs, Tally, network_legs, tally
from lobstr_hw.evaluation.tables import COLUMNS, ClipResult, document, markdown_table
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.motion import Motion
from lobstr_hw.rotations import rotation_x, rotation_y


@pytest.fixture(scope="module")
def truth() -> Truth:
    """A walk whose feet are said to stand in turns."""
    truth = Truth.of(walking(3.0))
    left = np.arange(len(truth)) // 20 % 2 == 0
    return replace(truth, contact=np.stack([left, ~left], axis=1))


def perfect(truth: Truth) -> Legs:
    return Legs(truth.joints, truth.p_toes, truth.contact)


def test_the_truth_itself_has_no_error(truth: Truth) -> None:
    scores = tally(truth, network_legs(truth, truth.joints, truth.contact.astype(float))).scores()
    for key in ("rotation_error_deg", "position_error_cm", "velocity_error_cm_s"):
        assert scores[key] == pytest.approx(0.0, abs=1e-5)
    for key in ("contact_accuracy", "contact_balanced_accuracy", "jitter_ratio"):
        assert scores[key] == pytest.approx(1.0)
    assert scores["skate_cm_s"] == pytest.approx(scores["truth_skate_cm_s"])
    assert scores["frames"] == len(truth) - 45


def test_the_first_second_is_not_scored(truth: Truth) -> None:
    legs = perfect(truth)
    p_toes = legs.p_toes.copy()
    p_toes[:45] += 1.0
    ours, theirs = (astuple(tally(truth, one)) for one in (replace(legs, p_toes=p_toes), legs))
    assert ours == pytest.approx(theirs, rel=1e-12)  # the order of a sum is the processor's
    p_toes[45] += 1.0
    assert tally(truth, replace(legs, p_toes=p_toes)).position_m > 0.0


def test_a_constant_offset_is_position_error_only(truth: Truth) -> None:
    legs = replace(perfect(truth), p_toes=truth.p_toes + np.array([0.0, 0.03, 0.04]))
    scores = tally(truth, legs).scores()
    assert scores["position_error_cm"] == pytest.approx(5.0)
    assert scores["velocity_error_cm_s"] == pytest.approx(0.0, abs=1e-9)
    assert scores["jitter_ratio"] == pytest.approx(1.0)


def test_a_constant_drift_is_velocity_error_and_no_jitter(truth: Truth) -> None:
    drift = np.zeros(truth.p_toes.shape)
    drift[..., 0] = 0.1 * np.arange(len(truth))[:, None] / truth.rate_hz
    scores = tally(truth, replace(perfect(truth), p_toes=truth.p_toes + drift)).scores()
    assert scores["velocity_error_cm_s"] == pytest.approx(10.0)
    assert scores["jitter_ratio"] == pytest.approx(1.0)


def test_skate_is_horizontal_and_only_while_the_truth_stands() -> None:
    frames = 120
    still = Motion(
        "set/still",
        "nobody",
        45.0,
        np.tile([0.0, 1.0, 0.0], (frames, 1)),
        np.broadcast_to(np.eye(3), (frames, 22, 3, 3)),
        np.tile([[0.09, 0.02, 0.12], [-0.09, 0.02, 0.12]], (frames, 1, 1)),
        1.0,
    )
    truth = Truth.of(still)
    slide = np.zeros((frames, 2, 3))
    slide[:, 0, 2] = 0.2 * np.arange(frames) / 45.0  # the left foot slides
    slide[:, 1, 1] = 0.2 * np.arange(frames) / 45.0  # the right one rises
    legs = replace(perfect(truth), p_toes=truth.p_toes + slide)
    assert tally(truth, legs).scores()["skate_cm_s"] == pytest.approx(10.0)
    nobody_stands = replace(truth, contact=np.zeros_like(truth.contact))
    assert tally(nobody_stands, legs).scores()["skate_cm_s"] is None


def test_held_skate_is_counted_while_the_legs_themselves_say_that_they_stand(truth: Truth) -> None:
    slide = np.zeros(truth.p_toes.shape)
    slide[..., 0] = 0.1 * np.arange(len(truth))[:, None] / truth.rate_hz
    still = replace(perfect(truth), p_toes=0.0 * truth.p_toes)
    sliding = replace(still, p_toes=slide)
    assert tally(truth, still).scores()["held_skate_cm_s"] == 0.0
    assert tally(truth, sliding).scores()["held_skate_cm_s"] == pytest.approx(10.0)
    nobody = replace(sliding, contact=np.zeros_like(truth.contact))
    assert tally(truth, nobody).scores()["held_skate_cm_s"] is None
    # the frame in which a foot lands, or leaves, is no held one
    landing = replace(nobody, contact=np.tile([[True], [False]], (len(truth) // 2 + 1, 2)))
    landing = replace(landing, contact=landing.contact[: len(truth)])
    assert tally(truth, landing).scores()["held_skate_cm_s"] is None


def test_the_cost_of_the_lock_is_the_share_of_toe_error_that_it_adds(truth: Truth) -> None:
    near, far = (
        tally(truth, replace(perfect(truth), p_toes=truth.p_toes + np.array([x, 0.0, 0.0])))
        for x in (0.08, 0.10)
    )
    scores = ClipResult("a/x", near, far).scores()
    assert scores["after_ik"]["position_cost"] == pytest.approx(0.25)
    assert scores["network"]["position_cost"] is None
    assert ClipResult("a/x", Tally(), Tally()).scores()["after_ik"]["position_cost"] is None


def test_a_turned_joint_counts_an_eighth_and_a_sixth(truth: Truth) -> None:
    joints = truth.joints.copy()
    joints[:, 0, 2] = joints[:, 0, 2] @ rotation_x(np.deg2rad(24.0))
    scores = tally(truth, replace(perfect(truth), joints=joints)).scores()
    assert scores["rotation_error_deg"] == pytest.approx(3.0)
    assert scores["rotation_error_legs_deg"] == pytest.approx(4.0)
    joints = truth.joints.copy()
    joints[:, 0, 0] = joints[:, 0, 0] @ rotation_y(0.3)
    scores = tally(truth, replace(perfect(truth), joints=joints)).scores()
    assert scores["rotation_error_legs_deg"] == pytest.approx(0.0, abs=1e-5)
    assert scores["rotation_error_deg"] == pytest.approx(np.rad2deg(0.3) / 8.0)


def test_always_saying_no_is_half_right_when_balanced(truth: Truth) -> None:
    legs = replace(perfect(truth), contact=np.zeros_like(truth.contact))
    scores = tally(truth, legs).scores()
    assert scores["contact_balanced_accuracy"] == pytest.approx(0.5)
    assert scores["contact_accuracy"] == pytest.approx(1.0 - truth.contact[45:].mean())


def test_a_foot_under_the_floor_is_told_and_one_on_it_is_not(truth: Truth) -> None:
    assert tally(truth, perfect(truth)).scores()["penetration_cm"] == pytest.approx(0.0, abs=1e-6)
    deep = replace(perfect(truth), p_toes=truth.p_toes - np.array([0.0, 0.5, 0.0]))
    scores = tally(truth, deep).scores()["penetration_cm"]
    assert scores is not None
    assert scores > 30.0


def test_tallies_add_up_as_if_the_clips_were_one(truth: Truth) -> None:
    rng = np.random.default_rng(0)
    legs = replace(perfect(truth), p_toes=truth.p_toes + rng.normal(0.0, 0.1, truth.p_toes.shape))
    one = tally(truth, legs)
    assert (one + one).scores()["position_error_cm"] == pytest.approx(
        one.scores()["position_error_cm"]
    )
    assert (one + Tally()) == one


def test_a_clip_of_less_than_a_second_scores_nothing() -> None:
    truth = Truth.of(walking(0.5))
    scores = tally(truth, perfect(truth)).scores()
    assert scores.pop("frames") == 0
    assert set(scores.values()) == {None}


def test_the_document_has_all_folders_and_clips(truth: Truth) -> None:
    one = tally(truth, perfect(truth))
    results = [ClipResult(name, one, one) for name in ("a/x", "a/y#1", "b/x")]
    tree = document(results)
    assert set(tree) == {"all", "folders", "clips"}
    assert set(tree["folders"]) == {"a", "b"}
    assert set(tree["clips"]) == {"a/x", "a/y#1", "b/x"}
    assert tree["all"]["network"]["frames"] == 3 * one.frames
    assert tree["folders"]["a"]["after_ik"]["frames"] == 2 * one.frames


def test_the_table_has_a_cell_for_each_metric(truth: Truth) -> None:
    lines = markdown_table([("none", Tally().scores())]).splitlines()
    assert {line.count("|") for line in lines} == {len(COLUMNS) + 2}
    assert lines[-1].count(" - ") == len(COLUMNS)
