"""Gaps of a recording: both ends are known beforehand."""

from dataclasses import replace

import numpy as np
import pytest
from support.even_motion import even_motion, out_of_sight

from lobstr_hw.features import Points, reference_frames
from lobstr_hw.lost_points import seen_points
from lobstr_hw.predictors import Frame, load_predictor
from lobstr_hw.predictors.gap_memory import FRAMES
from lobstr_hw.predictors.lobstr import Lobstr
from lobstr_hw.predictors.mended import mended
from lobstr_hw.predictors.refined import refined
from lobstr_hw.predictors.two_way import load_two_way
from lobstr_hw.rotations import geodesic_angle
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

PELVIS, LEFT = TrackerRole.PELVIS, TrackerRole.LEFT_HAND


def points(taken: list[Frame]) -> Points:
    single = [seen_points(frame) for frame in taken]
    p, R, valid_p, valid_R = (
        np.concatenate([getattr(one, name) for one in single])
        for name in ("p", "R", "valid_p", "valid_R")
    )
    return Points(p, R, valid_p, valid_R, reference_frames(R[:, 0]))


def linked(frames: int) -> np.ndarray:
    return np.arange(frames) > 0


@pytest.mark.parametrize("role", FOUR_POINTS)
def test_what_moved_evenly_is_where_it_was(role: TrackerRole) -> None:
    taken = even_motion(150, role)
    lost = out_of_sight(out_of_sight(taken, role, 10, 55), role, 60, 60 + FRAMES - 1)
    true, out = points(taken), mended(points(lost), linked(150))
    assert out.valid_p.all() and out.valid_R.all()
    assert out.p == pytest.approx(true.p)
    assert out.R == pytest.approx(true.R)
    assert out.R_ref == pytest.approx(true.R_ref)


def test_a_position_and_a_rotation_may_be_lost_at_different_times() -> None:
    taken = even_motion(80, PELVIS)
    whole, late = (points(out_of_sight(taken, PELVIS, first, 60)) for first in (10, 40))
    out = mended(replace(whole, p=late.p, valid_p=late.valid_p), linked(80))
    assert out.p == pytest.approx(points(taken).p)
    assert out.R == pytest.approx(points(taken).R)


def test_what_is_measured_stays_and_the_recording_is_left_as_it_is() -> None:
    before = points(out_of_sight(even_motion(80, PELVIS), PELVIS, 10, 55))
    kept = before.p.copy()
    out = mended(before, linked(80))
    assert (before.p == kept).all()
    assert (out.p[before.valid_p] == before.p[before.valid_p]).all()
    assert (out.R[before.valid_R] == before.R[before.valid_R]).all()


def test_what_does_not_come_back_in_time_is_not_called_measured() -> None:
    taken = out_of_sight(even_motion(200, PELVIS), PELVIS, 10, 10 + FRAMES)
    taken = out_of_sight(taken, LEFT, 150, 200)
    before = points(taken)
    assert (mended(before, linked(200)).valid_p == before.valid_p).all()


def test_no_gap_in_time_is_filled() -> None:
    before, steps = points(out_of_sight(even_motion(80, PELVIS), PELVIS, 10, 55)), linked(80)
    steps[30] = False
    assert (mended(before, steps).valid_p == before.valid_p).all()


def test_a_point_that_is_there_from_later_on_is_not_made_up_before() -> None:
    taken = even_motion(60, LEFT)
    first = taken[30].p[:, FOUR_POINTS.index(LEFT)]
    for i in range(30):
        p, valid = taken[i].p.copy(), taken[i].valid_p.copy()
        p[:, FOUR_POINTS.index(LEFT)], valid[:, FOUR_POINTS.index(LEFT)] = first, False
        taken[i] = replace(taken[i], p=p, valid_p=valid, valid_R=valid)
    before = points(taken)
    out = mended(before, linked(60))
    assert (out.p == before.p).all()
    assert (out.valid_p == before.valid_p).all()


def test_a_recording_with_gaps_is_refined_as_one_without() -> None:
    live = load_predictor("lobstr")
    assert isinstance(live, Lobstr)
    two_way, taken = load_two_way(), even_motion(240, PELVIS)
    lost = out_of_sight(out_of_sight(taken, PELVIS, 60, 105), PELVIS, 150, 200)
    whole, other = (refined(t, live, two_way).said for t in (taken, lost))
    assert geodesic_angle(whole.R, other.R).max() < 1e-3
