"""The network for recordings over clips: scored as the live one is."""

from dataclasses import replace

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.evaluation.at_once import roll_out_at_once
from lobstr_hw.evaluation.evaluate import compare, evaluate
from lobstr_hw.evaluation.rollout import roll_out
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.predictors import load_predictor
from lobstr_hw.predictors.lobstr import Lobstr
from lobstr_hw.predictors.two_way import TwoWay, load_two_way


@pytest.fixture(scope="module")
def clips() -> list[Truth]:
    return [Truth.of(walking(t, seed=i)) for i, t in enumerate((1.2, 3.5))]


@pytest.fixture(scope="module")
def two_way() -> TwoWay:
    return load_two_way()


@pytest.fixture(scope="module")
def live() -> Lobstr:
    predictor = load_predictor("lobstr")
    assert isinstance(predictor, Lobstr)
    return predictor


def test_every_frame_of_every_clip_is_said_once(
    two_way: TwoWay, live: Lobstr, clips: list[Truth]
) -> None:
    done: list[int] = []
    said = roll_out_at_once(two_way, live, clips, done.append)
    assert [len(one.R) for one in said] == [len(clip) for clip in clips] == done
    for one in said:
        assert one.joints.shape[1:] == (2, 4, 3, 3)
        np.testing.assert_allclose(np.linalg.det(one.joints), 1.0, atol=1e-6)


def test_an_early_frame_changes_with_what_comes_later(
    two_way: TwoWay, live: Lobstr, clips: list[Truth]
) -> None:
    other = Truth.of(walking(3.5, seed=1, speed_m_s=0.2))
    first = 40
    parts = {name: getattr(clips[1], name) for name in ("p", "R")}
    mixed = [
        np.concatenate([parts[name][:first], getattr(other, name)[first:]]) for name in ("p", "R")
    ]
    changed = replace(clips[1], p=mixed[0], R=mixed[1])
    before, after = (
        roll_out_at_once(two_way, live, [c])[0].R[first - 5] for c in (clips[1], changed)
    )
    live_before, live_after = (
        roll_out(live, [c], "carried")[0].R[first - 5] for c in (clips[1], changed)
    )
    assert np.abs(before - after).max() > 1e-3
    np.testing.assert_array_equal(live_before, live_after)


def test_comparing_what_was_said_is_evaluating(live: Lobstr, clips: list[Truth]) -> None:
    said = roll_out(live, clips, "carried")
    pairs = zip(compare(live.card, clips, said), evaluate(live, clips), strict=True)
    assert all(a == b for a, b in pairs)
