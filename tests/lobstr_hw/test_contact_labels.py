"""Laws of the contact labels."""

import numpy as np
import pytest
from support.motions import arms_down

from lobstr_hw.contact_labels import (
    contact_labels,
    debounced,
    local_floor,
    paper_contact_labels,
)
from lobstr_hw.rotations import Array

RATE_HZ = 45.0


def feet(frames: int = 300) -> Array:
    """Two toe bases flat on the floor."""
    p = np.zeros((frames, 2, 3))
    p[..., 1] = 0.02
    p[:, 0, 0], p[:, 1, 0] = 0.1, -0.1
    return p


def test_standing_feet_are_in_contact() -> None:
    assert contact_labels(feet(), RATE_HZ).all()
    assert paper_contact_labels(arms_down(1.0).p_toes).all()


def test_a_raised_foot_and_a_sliding_foot_are_not() -> None:
    p = feet()
    p[100:200, 0, 1] += 0.05
    p[:, 1, 2] = 0.3 * np.arange(300) / RATE_HZ
    labels = contact_labels(p, RATE_HZ)
    assert not labels[101:199, 0].any()
    assert labels[:99, 0].all()
    assert not labels[:, 1].any()


def test_the_floor_may_lie_anywhere() -> None:
    p = feet()
    p[100:200, 0, 1] += 0.05
    raised = p + np.array([0.0, 0.3, 0.0])
    assert (contact_labels(raised, RATE_HZ) == contact_labels(p, RATE_HZ)).all()
    assert not paper_contact_labels(raised).any()


def test_the_local_floor_is_the_lower_of_both_feet_within_two_seconds() -> None:
    heights = np.ones((400, 2))
    heights[200, 1] = 0.5
    floor = local_floor(heights, RATE_HZ)
    assert (floor[110:291] == 0.5).all()
    assert (floor[:110] == 1.0).all()
    assert (floor[291:] == 1.0).all()


def test_short_gaps_and_short_contacts_vanish_and_the_ends_stay() -> None:
    on = np.zeros((60, 2), dtype=bool)
    on[:2] = True  # touches the start
    on[10:13] = True  # a blip
    on[20:40] = True
    on[30:33] = False  # a gap
    labels = debounced(on, 5)
    expected = np.zeros((60, 2), dtype=bool)
    expected[:2] = True
    expected[20:40] = True
    assert (labels == expected).all()


def test_debouncing_leaves_no_short_run_and_twice_is_once() -> None:
    rng = np.random.default_rng(0)
    labels = debounced(rng.random((500, 2)) < 0.5, 5)
    for foot in labels.T:
        edges = np.flatnonzero(np.diff(foot)) + 1
        assert (np.diff(edges) >= 5).all()
    assert (debounced(labels, 5) == labels).all()


def test_the_paper_calls_it_contact_within_a_centimetre_of_flat_stance() -> None:
    p = feet(2)
    p[0, :, 1] = 0.029
    p[1, :, 1] = 0.031
    assert paper_contact_labels(p).tolist() == [[True, True], [False, False]]


def test_a_single_frame_has_a_label() -> None:
    assert contact_labels(feet(1), RATE_HZ).shape == (1, 2)
    assert contact_labels(feet(1), RATE_HZ) == pytest.approx(True)
