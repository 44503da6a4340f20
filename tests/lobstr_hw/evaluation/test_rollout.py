"""Running predictors over clips."""

import numpy as np
import pytest
from support.fake_predictor import FakePredictor
from support.motions import walking

from lobstr_hw.errors import ModelError
from lobstr_hw.evaluation.after_ik import show
from lobstr_hw.evaluation.evaluate import evaluate
from lobstr_hw.evaluation.rollout import groups_of_like_length, roll_out
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.predictors import Predictor, load_predictor


@pytest.fixture(scope="module")
def clips() -> list[Truth]:
    return [Truth.of(walking(t, seed=i)) for i, t in enumerate((1.2, 1.9, 1.5))]


@pytest.fixture(scope="module")
def lobstr() -> Predictor:
    return load_predictor("lobstr")


def test_every_clip_is_in_one_group_and_the_longest_leads(clips: list[Truth]) -> None:
    many = [clips[i % 3] for i in range(70)]
    groups = list(groups_of_like_length(many))
    assert sorted(i for group in groups for i in group) == list(range(70))
    for group in groups:
        lengths = [len(many[i]) for i in group]
        assert lengths[0] == max(lengths)
        assert min(lengths) >= 0.7 * lengths[0]


def test_clips_side_by_side_are_the_same_as_alone(lobstr: Predictor, clips: list[Truth]) -> None:
    together = roll_out(lobstr, clips, "carried")
    for clip, said in zip(clips, together, strict=True):
        alone = roll_out(lobstr, [clip], "carried")[0]
        assert len(said.R) == len(clip)
        assert said.R == pytest.approx(alone.R, abs=1e-4)


def test_in_its_first_second_a_window_is_the_clip_so_far(
    lobstr: Predictor, clips: list[Truth]
) -> None:
    carried, windowed = (roll_out(lobstr, clips[1:2], mode)[0] for mode in ("carried", "windowed"))
    assert windowed.R.shape == carried.R.shape
    assert windowed.R[:45] == pytest.approx(carried.R[:45], abs=1e-4)


def test_a_window_forgets_what_was_before_it(lobstr: Predictor) -> None:
    """45 frames back and no further, whatever the person did earlier."""
    clip = Truth.of(walking(2.4, seed=4))
    later = Truth.of(walking(2.4, seed=4))
    for name in ("p", "R"):
        values = getattr(later, name).copy()
        values[:20] = values[20]
        object.__setattr__(later, name, values)
    a, b = (roll_out(lobstr, [c], "windowed")[0] for c in (clip, later))
    # the first velocity of a window reaches one frame further back
    assert a.R[65:] == pytest.approx(b.R[65:], abs=1e-6)
    assert np.abs(a.R[30:40] - b.R[30:40]).max() > 1e-6


def test_only_a_network_of_windows_has_a_windowed_mode(clips: list[Truth]) -> None:
    with pytest.raises(ModelError, match="carried"):
        roll_out(load_predictor("standing"), clips, "windowed")


def test_a_predictor_without_hip_joints_is_told(clips: list[Truth]) -> None:
    with pytest.raises(ModelError, match="fake"):
        roll_out(FakePredictor(), clips[:1], "carried")


def test_the_truth_said_by_a_predictor_is_shown_as_the_truth(clips: list[Truth]) -> None:
    """C from the network and U from the shown leg meet in the same toes, but for lock and floor."""
    said = roll_out(load_predictor("standing"), clips[:1], "carried")
    shown = show(load_predictor("standing").card, clips[:1], said)[0]
    assert shown.p_toes.shape == (len(clips[0]), 2, 3)
    assert shown.locked.dtype == np.bool_
    assert shown.joints[:, :, 0] == pytest.approx(said[0].C)


def test_scores_are_finite_and_progress_reaches_the_end(
    lobstr: Predictor, clips: list[Truth]
) -> None:
    counted: list[int] = []
    results = evaluate(lobstr, clips, "carried", counted.append)
    assert sum(counted) == 2 * sum(len(clip) for clip in clips)
    assert [r.name for r in results] == [clip.name for clip in clips]
    for result in results:
        assert np.isfinite(result.network.position_m)
        assert result.network.frames == result.after_ik.frames
