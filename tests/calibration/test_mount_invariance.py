"""After calibration the body must not depend on how the trackers are strapped on."""

import mount_invariance as tool
import numpy as np
import pytest

from lobstr_hw.motion import Motion
from lobstr_hw.predictors import load_predictor
from lobstr_hw.simulation import Habits, TrackingErrors, calibrating_movement, drawn_user

SEEDS = (1, 2, 3, 4, 5, 6)


@pytest.fixture(scope="module")
def walk() -> Motion:
    """Somebody who stands, walks and turns on feet that do not slip, as people do."""
    rng = np.random.default_rng(1)
    return calibrating_movement(Habits.drawn(rng), rng)


@pytest.mark.parametrize("errors", [TrackingErrors.none(), TrackingErrors()])
def test_two_sets_of_mounts_give_lower_bodies_within_a_degree_and_a_half(
    walk: Motion, errors: TrackingErrors
) -> None:
    apart = tool.apart(load_predictor("lobstr"), walk, SEEDS, errors, 10.0)
    assert apart.shape[1:] == (6, 6)
    assert np.median(apart) < 1.5


def test_the_same_mounts_give_the_same_lower_body(
    walk: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = drawn_user
    monkeypatch.setattr(tool, "drawn_user", lambda seed, mount_seed: drawn(seed, mount_seed=0))
    apart = tool.apart(load_predictor("standing"), walk, SEEDS[:2], TrackingErrors.none(), 10.0)
    assert np.max(apart) < 1e-6
