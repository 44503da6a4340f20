"""Laws of following a device by light and IMU, in a made-up room."""

from dataclasses import replace

import numpy as np
import pytest
from support.lighthouse_room import Motion, carried, device, imu_of, light_of, room, still, track

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles
from lobstr_hw.drivers.lighthouse.light import take_angles
from lobstr_hw.drivers.lighthouse.tracker import Fix, PoseBatch
from lobstr_hw.rotations import Array, geodesic_angle

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

FIRST = 1_000_000
STILL = still(np.array([0.3, 0.8, 0.2]), np.array([0.3, 0.4, 0.1]))


def times(poses: PoseBatch) -> Array:
    return np.asarray((poses.ticks - FIRST) / TICKS_PER_S)


def off_m(poses: PoseBatch, motion: Motion) -> Array:
    return np.asarray(np.linalg.norm(poses.p - motion.p(times(poses)), axis=1))


def without(angles: Angles, since_s: float, until_s: float) -> Angles:
    t = (angles.ticks - FIRST) / TICKS_PER_S
    return take_angles(angles, (t < since_s) | (t > until_s))


@pytest.mark.parametrize("generation", [1, 2])
@pytest.mark.parametrize("flat", [False, True])
def test_a_carried_device_is_followed_within_two_millimetres(generation: int, flat: bool) -> None:
    stations, model, motion = room(generation), device(flat=flat), carried(1)
    imu = imu_of(motion, 2.0, noise=1.0, gyro_bias=0.02)
    light = light_of(stations, model, motion, 2.0, noise_rad=1e-4)
    poses = track(model, stations, imu, light)
    seen = poses.fix == Fix.LIGHT
    turned = np.degrees(geodesic_angle(poses.R, motion.R(times(poses))))
    assert np.count_nonzero(seen) > 0.35 * len(imu)
    assert np.median(off_m(poses, motion)[seen]) < 0.002
    assert np.median(turned[seen]) < 0.3


def test_every_imu_sample_has_one_pose_at_its_own_time() -> None:
    stations, model, motion = room(2), device(), carried(3)
    imu = imu_of(motion, 1.0)
    poses = track(model, stations, imu, light_of(stations, model, motion, 1.0))
    first = np.searchsorted(imu.ticks, poses.ticks[0])
    np.testing.assert_array_equal(poses.ticks, imu.ticks[first:])
    assert times(poses)[0] < 0.2


def test_poses_do_not_depend_on_how_the_data_are_cut() -> None:
    stations, model, motion = room(2), device(), carried(4)
    imu = imu_of(motion, 0.8, noise=1.0)
    light = light_of(stations, model, motion, 0.8, noise_rad=1e-4)
    a, b = (track(model, stations, imu, light, chunk_ticks=n) for n in (250_000, 9_600_000))
    np.testing.assert_array_equal(a.ticks, b.ticks)
    np.testing.assert_array_equal(a.fix, b.fix)
    np.testing.assert_allclose(a.p, b.p, atol=1e-9)


def test_light_that_comes_late_changes_nothing_while_within_the_lag() -> None:
    stations, model, motion = room(1), device(), carried(5)
    imu = imu_of(motion, 0.8)
    light = light_of(stations, model, motion, 0.8)
    # given 9 ms late, against light that is there at once
    late = track(model, stations, imu, light, chunk_ticks=9 * TICKS_PER_S // 1000)
    at_once = track(model, stations, imu, light, chunk_ticks=TICKS_PER_S)
    np.testing.assert_allclose(late.p, at_once.p, atol=1e-9)


@pytest.mark.parametrize("generation", [1, 2])
def test_a_device_at_rest_stands_still(generation: int) -> None:
    stations, model = room(generation), device()
    imu = imu_of(STILL, 3.0, noise=1.0, gyro_bias=0.03)
    light = light_of(stations, model, STILL, 3.0, noise_rad=1e-4)
    poses = track(model, stations, imu, light)
    rest = times(poses) > 2.0
    jitter = np.sqrt(np.mean(np.sum((poses.p[rest] - poses.p[rest].mean(axis=0)) ** 2, axis=1)))
    assert jitter < 0.0003
    np.testing.assert_array_equal(poses.v[rest], 0.0)


@pytest.mark.parametrize("seed", [1, 2, 6])
def test_an_occluded_device_is_reckoned_for_100_ms_then_lost_and_never_flies_off(seed: int) -> None:
    stations, model, motion = room(2), device(), carried(seed)
    imu = imu_of(motion, 2.2, noise=1.0, gyro_bias=0.02)
    light = without(light_of(stations, model, motion, 2.2, noise_rad=1e-4), 1.2, 1.8)
    poses = track(model, stations, imu, light)
    t, fix = times(poses), poses.fix
    dark = (t > 1.2) & (t < 1.8)
    assert not np.any(fix[dark & (t > 1.2 + 0.11)] != Fix.LOST)
    assert not np.any(fix[(t > 1.0) & (t < 1.2)] == Fix.LOST)
    followed = (fix != Fix.LOST) & (t > 0.5)
    assert np.max(off_m(poses, motion)[followed]) < 0.01
    frozen = poses.p[dark & (fix == Fix.LOST)]
    assert np.max(np.linalg.norm(frozen - motion.p(np.array([1.3])), axis=1)) < 0.05
    np.testing.assert_array_equal(poses.v[fix == Fix.LOST], 0.0)


@pytest.mark.parametrize("dark_s", [0.15, 0.6, 5.5])
def test_light_coming_back_is_taken_up_within_200_ms(dark_s: float) -> None:
    stations, model, motion = room(2), device(), carried(7)
    imu = imu_of(motion, dark_s + 1.2, noise=1.0)
    light = light_of(stations, model, motion, dark_s + 1.2, noise_rad=1e-4)
    poses = track(model, stations, imu, without(light, 0.6, 0.6 + dark_s))
    back = times(poses) > 0.6 + dark_s + 0.2
    assert not np.any(poses.fix[back] != Fix.LIGHT)
    assert np.max(off_m(poses, motion)[back]) < 0.01


def test_reflections_do_not_carry_a_device_away() -> None:
    stations, model, motion = room(2), device(), carried(8)
    imu = imu_of(motion, 1.5, noise=1.0)
    light = light_of(stations, model, motion, 1.5, noise_rad=1e-4)
    random = np.random.default_rng(0)
    bad = random.random(len(light)) < 0.1
    wrong = light.angle_rad + np.where(bad, random.uniform(-0.3, 0.3, len(light)), 0.0)
    spoilt = Angles(light.ticks, light.station, light.axis, light.sensor, wrong)
    poses = track(model, stations, imu, spoilt)
    later = times(poses) > 0.5
    assert not np.any(poses.fix[later] == Fix.LOST)
    assert np.max(off_m(poses, motion)[later]) < 0.01


@pytest.mark.parametrize("seed", [1, 2])
def test_a_shaken_imu_that_loses_samples_does_not_carry_a_device_away(seed: int) -> None:
    stations, model, motion = room(2), device(), carried(8)
    imu = imu_of(motion, 1.5, noise=1.0)
    light = light_of(stations, model, motion, 1.5, noise_rad=1e-4)
    random = np.random.default_rng(seed)
    t = (imu.ticks - FIRST) / TICKS_PER_S
    shaken = ((t > 0.6) & (t < 1.1))[:, None]  # as by a motor: nothing of it moves the device
    acc = imu.acc_g + shaken * random.normal(scale=0.8, size=imu.acc_g.shape)
    heard = random.random(len(imu)) > 0.3 * shaken[:, 0]
    poses = track(model, stations, replace(imu, acc_g=acc).take(heard), light)
    later = times(poses) > 0.3
    assert not np.any(poses.fix[later] == Fix.LOST)
    assert np.max(off_m(poses, motion)[later]) < 0.03
    assert np.max(off_m(poses, motion)[times(poses) > 1.2]) < 0.005


def test_covariance_tells_the_size_of_the_error() -> None:
    stations, model, motion = room(2), device(), carried(9)
    imu = imu_of(motion, 2.0, noise=1.0)
    poses = track(model, stations, imu, light_of(stations, model, motion, 2.0, noise_rad=2e-4))
    e = poses.p - motion.p(times(poses))
    size = np.einsum("ni,nij,nj->n", e, np.linalg.inv(poses.covariance[:, :3, :3]), e)
    assert 0.05 < np.median(size) < 8.0  # 2.4 for a perfect one


def test_nothing_comes_of_no_light() -> None:
    model, imu = device(), imu_of(STILL, 0.5)
    none = np.zeros(0, np.int64)
    poses = track(model, room(2), imu, Angles(none, none, none, none, np.zeros(0)))
    assert len(poses) == 0


@pytest.mark.parametrize("silent_s", [0.05, 0.3, 3.0])
def test_an_imu_that_was_silent_spoils_nothing(silent_s: float) -> None:
    stations, model, motion = room(2), device(), carried(7)
    imu = imu_of(motion, silent_s + 1.2, noise=1.0)
    light = light_of(stations, model, motion, silent_s + 1.2, noise_rad=1e-4)
    t = (imu.ticks - FIRST) / TICKS_PER_S
    heard = (t < 0.6) | (t > 0.6 + silent_s)
    imu = imu.take(heard)
    poses = track(model, stations, imu, without(light, 0.6, 0.6 + silent_s))
    followed = (poses.fix != Fix.LOST) & (np.abs(times(poses) - 0.7) < 2.0)
    assert np.max(off_m(poses, motion)[followed & (times(poses) > 0.3)]) < 0.02
    assert not np.any(poses.fix[times(poses) > 0.85 + silent_s] == Fix.LOST)
    whole = track(model, stations, imu, without(light, 0.6, 0.6 + silent_s), 2**40)
    np.testing.assert_array_equal(whole.ticks, poses.ticks)
    np.testing.assert_allclose(whole.p, poses.p, atol=1e-9)
    eye = np.swapaxes(poses.R, 1, 2) @ poses.R
    np.testing.assert_allclose(eye, np.broadcast_to(np.eye(3), eye.shape), atol=1e-6)
