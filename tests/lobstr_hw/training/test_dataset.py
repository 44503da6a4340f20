"""Clips as arrays and the windows drawn from them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.features import POINT_JOINTS, clip_features, clip_points
from lobstr_hw.lower_body import mirror_pose_6d
from lobstr_hw.motion import resampled
from lobstr_hw.training.augmentation import Augmentation
from lobstr_hw.training.config import TrainingConfig, read_config, write_config
from lobstr_hw.training.dataset import Clips, draw_windows, load_clips, save_clips, statistics

CLEAN = Augmentation("none")
CONFIG = TrainingConfig(window=20, mirror=False)


@pytest.fixture(scope="module")
def clips() -> Clips:
    walks = [replace(walking(t, seed=i), name=f"set/{i}") for i, t in enumerate((2.0, 4.0, 0.3))]
    return Clips.of(walks)


def test_the_cache_gives_back_what_was_put_in(clips: Clips, tmp_path: Path) -> None:
    save_clips(tmp_path / "clips.npz", clips)
    copy = load_clips(tmp_path / "clips.npz")
    assert copy.names.tolist() == ["set/0", "set/1", "set/2"]
    for name in ("start", "p", "R", "pose", "contact", "paper_contact"):
        assert (getattr(copy, name) == getattr(clips, name)).all()


def test_another_rate_is_refused() -> None:
    with pytest.raises(ValueError, match="30"):
        Clips.of([resampled(walking(1.0), 30.0)])


def test_selected_clips_keep_their_frames(clips: Clips) -> None:
    chosen = clips.select(np.array([False, True, True]))
    assert chosen.names.tolist() == ["set/1", "set/2"]
    assert (chosen.p == clips.p[clips.start[1] :]).all()
    assert chosen.start.tolist() == (clips.start[1:] - clips.start[1]).tolist()


def test_a_window_is_a_piece_of_the_clips_features(clips: Clips) -> None:
    windows = draw_windows(clips, 50, CONFIG, CLEAN, np.random.default_rng(0))
    p, R = walking(4.0, seed=1).joints()
    x = clip_features(clip_points(p[:, POINT_JOINTS], R[:, POINT_JOINTS]))
    found = 0
    for window in windows.x:
        distance = np.abs(x[20:, :] - window[-1]).max(axis=1)
        i = 20 + int(distance.argmin())
        if distance[i - 20] < 1e-5:
            assert window == pytest.approx(x[i - 19 : i + 1], abs=1e-5)
            found += 1
    assert found > 20


def test_windows_do_not_reach_into_another_clip(clips: Clips) -> None:
    """Between two clips the hips jump by metres, which would be seen as a speed."""
    windows = draw_windows(clips, 500, CONFIG, CLEAN, np.random.default_rng(0))
    assert np.abs(windows.x[..., :3]).max() < 0.1


def test_clips_are_drawn_in_proportion_to_their_frames(clips: Clips) -> None:
    windows = draw_windows(clips, 3000, CONFIG, CLEAN, np.random.default_rng(0))
    last = np.abs(clips.pose[None, :, :] - windows.pose[:300, None, :]).max(axis=-1).argmin(axis=1)
    share = (last < clips.start[1]).mean()
    assert share == pytest.approx(1.0 / 3.0, abs=0.1)


def test_half_of_the_windows_are_mirrored(clips: Clips) -> None:
    rng = np.random.default_rng
    straight = draw_windows(clips, 400, CONFIG, CLEAN, rng(0))
    mixed = draw_windows(clips, 400, replace(CONFIG, mirror=True), CLEAN, rng(0))
    mirrored = mirror_pose_6d(straight.pose.astype(np.float64)).astype(np.float32)
    same = (mixed.pose == straight.pose).all(axis=1)
    other = (mixed.pose == mirrored).all(axis=1)
    assert (same | other).all()
    assert same.mean() == pytest.approx(0.5, abs=0.1)
    assert (mixed.contact[other] == straight.contact[other][:, ::-1]).all()


def test_the_same_seed_draws_the_same_windows(clips: Clips) -> None:
    a, b = (
        draw_windows(clips, 10, TrainingConfig(window=20), Augmentation(), np.random.default_rng(5))
        for _ in range(2)
    )
    assert (a.x == b.x).all()


def test_clips_that_are_all_too_short_are_told(clips: Clips) -> None:
    with pytest.raises(ValueError, match="longer than 1000"):
        draw_windows(clips, 1, replace(CONFIG, window=1000), CLEAN, np.random.default_rng(0))


def test_z_scoring_makes_unit_channels_and_has_a_floor(clips: Clips) -> None:
    stats = statistics(clips, CONFIG)
    x = np.concatenate(
        [
            clip_features(clip_points(clips.p[a:b].astype(float), clips.R[a:b].astype(float)))
            for a, b in zip(clips.start[:-1], clips.start[1:], strict=True)
        ]
    )
    z = (x - stats.input_mean) / stats.input_scale
    assert np.abs(z.mean(axis=0)).max() < 1e-3
    assert z.std(axis=0).max() < 1.01
    assert stats.input_scale.min() >= np.float32(1e-3)


def test_mirroring_makes_the_statistics_symmetric(clips: Clips) -> None:
    stats = statistics(clips, replace(CONFIG, mirror=True))
    mean = stats.output_mean.astype(np.float64)
    assert mirror_pose_6d(mean) == pytest.approx(mean, abs=1e-6)
    assert stats.contact_mean[0] == pytest.approx(stats.contact_mean[1])


def test_a_configuration_written_and_read_is_the_same(tmp_path: Path) -> None:
    config = replace(TrainingConfig(seed=9), augmentation=Augmentation("white"))
    write_config(tmp_path / "config.json", config)
    assert read_config(tmp_path / "config.json") == config
    assert read_config(tmp_path / "config.json", steps=3) == replace(config, steps=3)
