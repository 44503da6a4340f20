"""The yardstick predictors."""

import numpy as np
import pytest

from lobstr_hw.predictors import SHIPPED_WEIGHTS, Frame, load_predictor
from lobstr_hw.predictors.weights import read_card
from lobstr_hw.rotations import to_6d
from lobstr_hw.skeleton import Body
from lobstr_hw.trackers import FOUR_POINTS


def frame(n: int) -> Frame:
    ok = np.ones((n, 4), dtype=bool)
    R = np.broadcast_to(np.eye(3), (n, 4, 3, 3))
    return Frame(0.0, FOUR_POINTS, np.ones((n, 4, 3)), R, ok, ok)


def test_standing_is_the_t_pose_for_everybody() -> None:
    standing = load_predictor("standing")
    _, said = standing.step(standing.start(Body.standard(3)), frame(3))
    assert said.R == pytest.approx(np.broadcast_to(np.eye(3), (3, 6, 3, 3)))
    assert said.contact == pytest.approx(np.ones((3, 2)))


def test_the_mean_pose_is_the_cards() -> None:
    card = read_card(SHIPPED_WEIGHTS.with_suffix(".json"))
    mean = load_predictor("mean_pose")
    _, said = mean.step(mean.start(Body.standard(2)), frame(2))
    assert said.C is not None
    Z = card.output_mean[:3] / np.linalg.norm(card.output_mean[:3])
    assert to_6d(said.C[1, 0])[:3] == pytest.approx(Z, abs=1e-6)
    assert said.contact[0] == pytest.approx(card.contact_mean)
