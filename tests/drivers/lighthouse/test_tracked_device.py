"""From reports to poses: by the device's own time, however reports are handed over."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.lighthouse_room import Motion, carried, device, room, still
from support.lighthouse_wire import FIRST_TICK, config_of, reports_of

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S
from lobstr_hw.drivers.lighthouse.captured_device import read_devices
from lobstr_hw.drivers.lighthouse.decoding import Decoded, DeviceDecoder
from lobstr_hw.drivers.lighthouse.device_config import inflate_config, parse_config
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle

HEAD = Pose(from_rotation_vector(np.array([0.0, np.pi, 0.3])), np.array([0.02, -0.05, 0.08]))
"""Where the reported frame lies in the IMU's; real ones lie like this."""


def tracked(motion: Motion, seconds: float, cut: int = 1, dark: bool = False) -> TimedPoses:
    """A made-up device's poses; they are asked for after every ``cut`` reports."""
    model = replace(device(), T_imu_head=HEAD)
    dark_s = (0.7, 1.2) if dark else (0.0, 0.0)
    found = TrackedDevice(model, room(2))
    parts = []
    for k, report in enumerate(reports_of(room(2), model, motion, seconds, dark_s=dark_s)):
        found.feed(report.data)
        if k % cut == 0:
            parts.append(found.poses())
    parts.append(found.poses())
    return joined(parts)


def joined(parts: list[TimedPoses]) -> TimedPoses:
    names = ("ticks", "p", "R", "velocity", "covariance", "fix")
    return TimedPoses(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))


def at(poses: TimedPoses) -> Array:
    return np.asarray((poses.ticks - FIRST_TICK) / TICKS_PER_S)


def head_of(motion: Motion, t: Array) -> Pose:
    return Pose(motion.R(t), motion.p(t)) @ HEAD


def test_poses_are_those_of_the_reported_frame_at_their_own_times() -> None:
    motion = carried(1)
    poses = tracked(motion, 1.2)
    t, h = at(poses), 1e-4
    true = head_of(motion, t)
    velocity = (head_of(motion, t + h).p - head_of(motion, t - h).p) / (2 * h)
    assert len(poses) > 200
    assert np.median(np.linalg.norm(poses.p - true.p, axis=1)) < 5e-4
    assert np.median(geodesic_angle(poses.R, true.R)) < 2e-3
    assert np.median(np.linalg.norm(poses.velocity - velocity, axis=1)) < 1e-2


def test_the_covariance_is_about_as_large_as_the_errors() -> None:
    motion = carried(2)
    poses = tracked(motion, 2.0)
    true = head_of(motion, at(poses))
    settled = at(poses) > 0.5
    off = (poses.p - true.p)[settled]
    turned = np.swapaxes(true.R, 1, 2)[settled] @ poses.R[settled]
    sigma_p = np.sqrt(np.trace(poses.covariance[settled, :3, :3], axis1=1, axis2=2))
    sigma_R = np.sqrt(np.trace(poses.covariance[settled, 3:, 3:], axis1=1, axis2=2))
    error_R = geodesic_angle(turned, np.eye(3))
    assert 0.1 < np.median(np.linalg.norm(off, axis=1) / sigma_p) < 3.0
    assert 0.1 < np.median(error_R / sigma_R) < 3.0


def test_how_reports_are_handed_over_makes_no_difference() -> None:
    one, many = (tracked(carried(3), 0.8, cut) for cut in (1, 10_000))
    for name in ("ticks", "p", "R", "velocity", "covariance", "fix"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))


def test_a_device_that_lies_still_has_no_velocity() -> None:
    poses = tracked(still(np.array([0.2, 0.9, 0.1]), np.array([0.2, 0.4, 0.1])), 1.5)
    rest = at(poses) > 1.0
    assert np.count_nonzero(rest) > 100
    np.testing.assert_array_equal(poses.velocity[rest], 0.0)


def test_in_the_dark_it_is_not_tracked_any_more_and_then_again() -> None:
    poses = tracked(carried(7), 2.0, dark=True)
    t = at(poses)
    assert not np.any(poses.tracked[(t > 0.82) & (t < 1.2)])
    assert np.all(poses.tracked[t > 1.42])
    np.testing.assert_array_equal(poses.velocity[~poses.tracked], 0.0)


def test_stations_can_be_told_later_and_taken_away() -> None:
    model, stations = device(), room(2)
    found = TrackedDevice(model, {})
    reports = reports_of(stations, model, carried(4), 1.5)
    thirds = [reports[k * len(reports) // 3 : (k + 1) * len(reports) // 3] for k in range(3)]
    given = []
    for part, known in zip(thirds, ({}, stations, {}), strict=True):
        found.use_stations(known, same_world=bool(known))
        for report in part:
            found.feed(report.data)
        given.append(found.poses())
    assert len(given[0]) == 0
    assert given[1].tracked[-1]
    assert not given[2].tracked.any()


@pytest.mark.parametrize("left", [{0, 1}, {0, 2}, {1, 2}, {2}, set()])
def test_stations_can_be_taken_away_while_their_light_waits_to_be_used(left: set[int]) -> None:
    model, stations = device(), room(2, count=3)
    kept = {n: s for n, s in stations.items() if n in left}
    motion = carried(4)
    reports = reports_of(stations, model, motion, 1.0)
    found = TrackedDevice(model, stations)
    for k, report in enumerate(reports):
        if k == len(reports) // 2:
            found.use_stations(kept)
        found.feed(report.data)
    poses = found.poses()
    assert poses.tracked[-1] == bool(left)
    off = np.linalg.norm(poses.p - motion.p(at(poses)), axis=1)
    settled = poses.tracked & (at(poses) > 0.5)
    assert not settled.any() or off[settled].max() < 0.02


def test_a_whole_recording_of_events_gives_poses_too() -> None:
    model, motion = device(), carried(5)
    whole, fed = TrackedDevice(model, room(2)), TrackedDevice(model, room(2))
    reports = reports_of(room(2), model, motion, 1.5)
    for report in reports:
        whole.reader.feed(report.data)
        fed.feed(report.data)
    whole.feed_events(whole.reader.take())
    a, b = whole.poses(), fed.poses()
    np.testing.assert_array_equal(a.ticks[: len(b)], b.ticks)
    np.testing.assert_allclose(a.p[: len(b)], b.p, atol=1e-9)


def test_every_batch_is_shown_to_who_wants_to_see_it() -> None:
    model = device()
    found, seen = TrackedDevice(model, {}), list[Decoded]()
    found.decoded = seen.append
    for report in reports_of(room(2), model, carried(6), 0.4):
        found.feed(report.data)
    assert sum(len(batch.imu) for batch in seen) > 80
    assert sum(len(batch.angles) for batch in seen) > 500


def test_the_made_up_configuration_is_the_device() -> None:
    model = device(seed=4)
    read = parse_config(inflate_config(config_of(model)))
    np.testing.assert_array_equal(read.points, model.points)
    np.testing.assert_array_equal(read.normals, model.normals)
    assert (read.serial, read.device_class) == (model.serial, model.device_class)


ROOT = Path(__file__).parents[3]
DATA = Path(os.environ.get("LOBSTR_DATA", ROOT.parent / "shared" / "data")) / "lighthouse"


def test_a_real_devices_hits_are_those_of_its_recording() -> None:
    """Bit for bit: the way of live devices and the way of files are one."""
    path = DATA / "usbmon" / "wireless-tracker.pcap.gz"
    if not path.exists():
        pytest.skip("set LOBSTR_DATA to the folder that holds lighthouse/ to run this")
    reports = list(read_usbmon(path))
    [(key, known)] = [(k, d) for k, d in read_devices(reports).items() if d.model is not None]
    assert known.model is not None
    whole = DeviceDecoder(known.model, known.ranges).decode(known.reader.take())
    live, seen = TrackedDevice(known.model, {}, known.ranges), list[Decoded]()
    live.reader.use_old_radio()
    live.decoded = seen.append
    configured = False
    for report in reports:
        configured |= report.kind is ReportKind.FEATURE_GET and report.data[:2] == b"\x11\x00"
        if report.device == key and report.kind is ReportKind.INPUT and configured:
            live.feed(report.data)
    angles = np.concatenate([batch.angles.angle_rad for batch in seen])
    assert len(angles) > 10_000
    np.testing.assert_array_equal(angles, whole.angles.angle_rad[: len(angles)])
    assert {n: c.id for n, c in live.heard.items()} == {n: c.id for n, c in whole.stations.items()}
