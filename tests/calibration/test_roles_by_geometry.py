"""Roles: hints are believed, the rest goes by where the trackers are."""

from itertools import permutations

import numpy as np
import pytest

from lobstr_hw.calibration.priors import IDEAL_DEVICE
from lobstr_hw.calibration.roles import assign_roles
from lobstr_hw.errors import MissingRole
from lobstr_hw.rotations import Array, rotation_y
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

SERIALS = ["A", "B", "C", "D"]  # head, left hand, right hand, pelvis
P = np.array([[0.0, 1.6, 0.1], [0.8, 1.4, 0.05], [-0.8, 1.45, 0.0], [0.02, 1.0, 0.15]])


def poses(yaw: float) -> tuple[Array, Array]:
    R = rotation_y(yaw)
    return P @ R.T, np.broadcast_to(R @ IDEAL_DEVICE, (4, 3, 3))


@pytest.mark.parametrize("yaw", [-3.0, -1.2, 0.0, 0.9, 2.4])
@pytest.mark.parametrize("order", list(permutations(range(4)))[::5])
def test_the_order_and_the_heading_do_not_matter(order: tuple[int, ...], yaw: float) -> None:
    p, R = poses(yaw)
    at = list(order)
    found = assign_roles([SERIALS[i] for i in at], p[at], R[at], {})
    assert [at[found[role]] for role in FOUR_POINTS] == [0, 1, 2, 3]


@pytest.mark.parametrize("hinted", [(0,), (1,), (3,), (0, 2), (1, 3), (0, 1, 2), (0, 1, 2, 3)])
def test_some_hints_and_geometry_agree(hinted: tuple[int, ...]) -> None:
    hints = {SERIALS[i]: FOUR_POINTS[i] for i in hinted}
    found = assign_roles(SERIALS, *poses(0.4), hints)
    assert [found[role] for role in FOUR_POINTS] == [0, 1, 2, 3]


def test_a_hint_is_believed_against_geometry() -> None:
    hints = {"B": TrackerRole.RIGHT_HAND, "C": TrackerRole.LEFT_HAND}
    found = assign_roles(SERIALS, *poses(0.0), hints)
    assert found[TrackerRole.LEFT_HAND] == 2


def test_trackers_on_the_feet_are_no_pelvis() -> None:
    p, R = poses(0.3)
    p = np.concatenate([p, [[0.1, 0.1, 0.0]]])
    R = np.concatenate([R, R[:1]])
    found = assign_roles([*SERIALS, "E"], p, R, {"E": TrackerRole.LEFT_FOOT})
    assert found[TrackerRole.PELVIS] == 3


def test_three_trackers_are_too_few() -> None:
    p, R = poses(0.0)
    with pytest.raises(MissingRole, match="switch the missing one on"):
        assign_roles(SERIALS[:3], p[:3], R[:3], {})
