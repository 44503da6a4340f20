"""Laws of hands that are somebody else's: only hands change, and they are whole."""

import numpy as np

from lobstr_hw.features import POINT_ROLES
from lobstr_hw.trackers import TrackerRole
from lobstr_hw.training.borrowed_hands import with_borrowed_hands

LEFT = POINT_ROLES.index(TrackerRole.LEFT_HAND)
RIGHT = POINT_ROLES.index(TrackerRole.RIGHT_HAND)
HANDS = [LEFT, RIGHT]


def some_input(streams: int = 40) -> np.ndarray:
    return np.random.default_rng(2).standard_normal((streams, 5, 37)).astype(np.float32)


def rows(x: np.ndarray) -> np.ndarray:
    return x[..., :36].reshape(*x.shape[:-1], 4, 9)


def test_who_borrows_has_both_hands_of_one_other_and_the_rest_is_his_own() -> None:
    x = some_input()
    out = with_borrowed_hands(x, 0.5, np.random.default_rng(0))
    np.testing.assert_array_equal(out[..., 36], x[..., 36])
    others = [i for i in range(4) if i not in HANDS]
    np.testing.assert_array_equal(rows(out)[:, :, others], rows(x)[:, :, others])
    whose = [
        next(k for k in range(len(x)) if (rows(x)[k][:, HANDS] == hands).all())
        for hands in rows(out)[:, :, HANDS]
    ]
    changed = np.flatnonzero(np.array(whose) != np.arange(len(x)))
    assert 10 < len(changed) < 30


def test_nobody_borrows_at_share_zero_and_what_was_given_is_kept() -> None:
    x = some_input()
    before = x.copy()
    np.testing.assert_array_equal(with_borrowed_hands(x, 0.0, np.random.default_rng(0)), before)
    with_borrowed_hands(x, 1.0, np.random.default_rng(0))
    np.testing.assert_array_equal(x, before)
