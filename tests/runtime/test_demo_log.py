"""The bundled demo log is what the first screen promises."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from lobstr_hw.drivers.tracker_log import TrackerLog, read_log
from lobstr_hw.drivers.tracker_log.quality import quality
from lobstr_hw.rotations import heading_angle
from lobstr_hw.skeleton import Joint
from lobstr_hw.trackers import FOUR_POINTS

FOLDER = Path(str(files("lobstr_hw.runtime") / "demo"))


@pytest.fixture(scope="module")
def demo() -> TrackerLog:
    return read_log(FOLDER / "demo.mcap")


def test_it_is_whole_small_and_long_enough(demo: TrackerLog) -> None:
    assert not demo.cut
    assert demo.path.stat().st_size <= 3_000_000
    assert demo.duration_s >= 60.0


def test_four_trackers_report_at_90_hz_with_a_few_troubles(demo: TrackerLog) -> None:
    assert {track.role for track in demo.trackers} == set(FOUR_POINTS)
    found = [quality(track) for track in demo.trackers]
    assert {round(q.rate_hz, 2) for q in found} == {90.0}
    assert 0 < sum(len(q.dropouts_s) for q in found) < 10
    assert 0 < sum(len(q.jumps_s) for q in found) < 20
    assert sum(q.broken for q in found) == 0


def test_it_begins_with_a_t_pose(demo: TrackerLog) -> None:
    assert demo.t_pose_s == (0.0, 3.0)
    assert demo.truth is not None
    still = demo.truth.times_s < 3.0
    hands = demo.truth.p_world[still][:, [Joint.LEFT_HAND, Joint.RIGHT_HAND]]
    assert np.linalg.norm(hands[:, 0] - hands[:, 1], axis=-1).min() > 1.2


def test_someone_stands_walks_turns_reaches_and_sits_within_a_room(demo: TrackerLog) -> None:
    truth = demo.truth
    assert truth is not None and truth.R_world is not None
    hips = truth.p_world[:, Joint.HIPS]
    speed = np.linalg.norm(np.gradient(hips, axis=0)[:, [0, 2]], axis=-1) * 45.0
    yaw = np.unwrap(heading_angle(truth.R_world[:, 0])[0])
    assert np.mean(speed > 0.5) > 0.2, "walking"
    assert np.mean(speed < 0.15) > 0.15, "standing"
    assert np.ptp(yaw) > 2.0 * np.pi, "turning"
    sitting = hips[:, 1] < 0.62 * hips[:, 1].max()
    assert 1.0 < sitting.sum() / 45.0 < 10.0
    assert hips[-1, 1] > 0.9 * hips[:, 1].max(), "and stands up again"
    assert truth.p_world[:, Joint.LEFT_HAND, 1].max() > truth.p_world[:, Joint.HEAD, 1].max()
    assert np.ptp(hips, axis=0).max() < 3.6


def test_its_origin_and_licence_lie_beside_it() -> None:
    notice = (FOLDER / "NOTICE.md").read_text(encoding="utf-8")
    for word in ("snumrl/TillingPatch", "snumrl/ys2010", "Apache License, Version 2.0"):
        assert word in notice
