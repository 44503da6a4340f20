"""Laws of the made tracker errors."""

import numpy as np
import pytest

from lobstr_hw.rotations import geodesic_angle
from lobstr_hw.training.augmentation import Augmentation, add_tracker_errors

SHAPE = (46, 200, 4)
P = np.zeros((*SHAPE, 3))
R = np.broadcast_to(np.eye(3), (*SHAPE, 3, 3))


def test_no_errors_is_the_poses_themselves() -> None:
    p, turned = add_tracker_errors(P, R, 45.0, Augmentation("none"), np.random.default_rng(0))
    assert (p == P).all()
    assert (turned == R).all()


@pytest.mark.parametrize("kind", ["drift", "white"])
def test_the_errors_are_as_large_as_asked_for(kind: str) -> None:
    augmentation = Augmentation("drift" if kind == "drift" else "white")
    p, turned = add_tracker_errors(P, R, 45.0, augmentation, np.random.default_rng(0))
    # a signed length of deviation sigma in a random direction
    assert np.sqrt((p**2).sum(-1).mean()) == pytest.approx(0.01, rel=0.1)
    angle = np.rad2deg(geodesic_angle(turned, R))
    assert angle.max() <= 1.5
    assert angle.mean() > 0.4


def test_drift_is_slow_and_white_is_not() -> None:
    """The false speed is what ruins velocities: half a metre per second against a few cm."""
    speed = {}
    for augmentation in (Augmentation("drift"), Augmentation("white")):
        rng = np.random.default_rng(0)
        p, _ = add_tracker_errors(P, R, 45.0, augmentation, rng)
        speed[augmentation.kind] = np.linalg.norm(np.diff(p, axis=0), axis=-1).mean() * 45.0
    assert speed["white"] > 0.5
    assert speed["drift"] < 0.1 * speed["white"] * 1.2


def test_the_same_seed_gives_the_same_errors() -> None:
    a, b = (
        add_tracker_errors(P, R, 45.0, Augmentation(), np.random.default_rng(7)) for _ in range(2)
    )
    assert (a[0] == b[0]).all()
    assert (a[1] == b[1]).all()
