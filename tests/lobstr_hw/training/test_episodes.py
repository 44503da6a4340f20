"""What carried training plays: episodes of clips, their balance, and streams that go on."""

from dataclasses import replace

import numpy as np
import pytest
from support.motions import arms_down, walking

from lobstr_hw.features import POINT_JOINTS, clip_features, clip_points, reference_frames
from lobstr_hw.rotations import heading_angle, rotation_y
from lobstr_hw.training.augmentation import Augmentation
from lobstr_hw.training.balance import frame_weights, kinds_of_motion
from lobstr_hw.training.config import CarriedSettings, TrainingConfig, recipe_config
from lobstr_hw.training.dataset import Clips, Float32
from lobstr_hw.training.episodes import Episode, EpisodeSource
from lobstr_hw.training.streams import Position, Streams

PLAIN = CarriedSettings(mean_chunks=3.0, warp_share=0.0, lever_m=0.0, dropout_share=0.0)
CONFIG = recipe_config(
    "carried",
    batch=5,
    window=10,
    mirror=False,
    mirror_mean=False,
    augmentation=Augmentation("none"),
    carried=PLAIN,
)


@pytest.fixture(scope="module")
def clips() -> Clips:
    walks = [
        replace(walking(t, seed=i), name=f"set/{i}", subject=who)
        for i, (t, who) in enumerate(((2.0, "a"), (6.0, "a"), (0.1, "b"), (1.0, "b")))
    ]
    return Clips.of([*walks, replace(arms_down(3.0), name="set/still", subject="a")])


def drawn(clips: Clips, config: TrainingConfig, n: int = 40) -> list[Episode]:
    source = EpisodeSource(clips, config)
    return [source.draw(np.random.default_rng([7, i])) for i in range(n)]


def test_an_undisturbed_episode_is_a_piece_of_one_clip(clips: Clips) -> None:
    for episode in drawn(clips, CONFIG):
        assert len(episode) % CONFIG.window == 0
        nearest = np.abs(clips.pose - episode.pose[0]).max(axis=1) < 1e-6
        # a walk's legs repeat: some of these frames are of another step
        assert any(_is_piece(clips, int(first), episode) for first in np.flatnonzero(nearest))


def _is_piece(clips: Clips, first: int, episode: Episode) -> bool:
    at = slice(first, first + len(episode))
    p, R = clips.p[at].astype(float), clips.R[at].astype(float)
    if len(p) < len(episode):
        return False
    same_pose = np.abs(clips.pose[at] - episode.pose).max() < 1e-6
    same_x = np.abs(clip_features(clip_points(p, R)) - episode.x).max() < 1e-5
    return bool(same_pose and same_x and (clips.contact[at] == episode.contact).all())


def test_an_episode_begins_as_a_session_does(clips: Clips) -> None:
    """Nothing to difference with: no movement, whatever came before in the clip."""
    for episode in drawn(clips, CONFIG):
        assert not episode.x[0, :3].any()
        assert episode.x[0, 3:9] == pytest.approx([0, 0, 1, 0, 1, 0], abs=1e-6)


def test_another_speed_scales_velocities_and_not_poses(clips: Clips) -> None:
    config = replace(CONFIG, carried=replace(PLAIN, warp_share=1.0, warp_min=1.3, warp_max=1.3))
    only_walks = clips.select(np.array([False, True, False, False, False]))
    for episode in drawn(only_walks, config, 10):
        p, _ = walking(6.0, seed=1).joints()
        speed = np.linalg.norm(np.diff(p[:, POINT_JOINTS[0]], axis=0), axis=1).mean()
        played = np.linalg.norm(episode.x[1:, :3], axis=1).mean()
        assert played / speed == pytest.approx(1.3, rel=0.05)
        nearest = np.abs(only_walks.pose[None] - episode.pose[:, None]).max(axis=-1).min(axis=1)
        assert nearest.max() < 0.1
        axes = episode.pose.reshape(len(episode), -1, 3)
        assert np.linalg.norm(axes, axis=-1) == pytest.approx(1.0, abs=1e-5)


def test_mirroring_twice_changes_nothing_and_once_turns_the_heading(clips: Clips) -> None:
    for episode in drawn(clips, CONFIG, 5):
        once, twice = episode.mirrored(), episode.mirrored().mirrored()
        for name in ("x", "pose", "contact", "yaw"):
            assert getattr(twice, name) == pytest.approx(getattr(episode, name))
        assert once.yaw == pytest.approx(-episode.yaw)


def test_the_yaw_is_of_the_true_reference_frame_even_when_trackers_err(clips: Clips) -> None:
    bad = replace(
        CONFIG,
        augmentation=Augmentation("white", 0.05, 10.0),
        carried=replace(PLAIN, lever_m=0.1, dropout_share=1.0),
    )
    headings = heading_angle(reference_frames(clips.R[:, 0].astype(float)))[0]
    for episode in drawn(clips, bad, 10):
        first = int(np.abs(clips.pose - episode.pose[0]).max(axis=1).argmin())
        assert episode.yaw == pytest.approx(headings[first : first + len(episode)], abs=1e-5)


def test_levers_disturb_turns_but_not_the_height_of_upright_hips(clips: Clips) -> None:
    still = clips.select(np.array([False, False, False, False, True]))
    off = replace(CONFIG, carried=replace(PLAIN, lever_m=0.1))
    for episode in drawn(still, off, 10):
        assert episode.x[:, -1] == pytest.approx(1.0, abs=1e-5)
    walk = clips.select(np.array([False, True, False, False, False]))
    for episode, plain in zip(drawn(walk, off, 10), drawn(walk, CONFIG, 10), strict=True):
        assert len(episode) == len(plain)
        assert np.abs(episode.x - plain.x)[:, :3].max() > 1e-4


def test_a_lost_point_is_guessed_and_in_half_of_the_gaps_led_to_where_it_is_back(
    clips: Clips,
) -> None:
    """Nothing else changes; led there it has gone as far as the true one when the gap is over."""
    long = clips.select(np.array([False, True, False, False, False]))
    calm, lossy = (
        replace(CONFIG, carried=replace(PLAIN, mean_chunks=40.0, dropout_share=share))
        for share in (0.0, 1.0)
    )
    led = guessed = 0
    for one, plain in zip(drawn(long, lossy, 80), drawn(long, calm, 80), strict=True):
        rows, true = (e.x[:, :36].reshape(-1, 4, 9) for e in (one, plain))
        assert np.isfinite(one.x).all()
        changed = np.abs(rows - true).max(axis=-1) > 1e-5
        if changed[:, 0].any() or not changed.any():
            continue  # without the pelvis another heading is guessed, and all is seen from there
        gap = np.flatnonzero(changed.any(axis=1))
        if gap[-1] == len(rows) - 1:
            continue  # never back
        assert changed.any(axis=0).sum() == 1, "one point is lost"
        assert np.ptp(gap) <= round(1.5 * 45.0)
        went, goes = (travelled(e.x, plain.yaw)[gap].sum(axis=0) for e in (one, plain))
        is_led = np.abs(went - goes).max() < 1e-4
        led, guessed = led + is_led, guessed + (not is_led)
    assert min(led, guessed) > 10


def travelled(x: Float32, yaw: Float32) -> Float32:
    """World movements (frames, 4, 3) of the points."""
    v = x[:, :36].reshape(-1, 4, 9)[..., :3]
    return (rotation_y(yaw.astype(np.float64))[:, None] @ v[..., None])[..., 0].astype(np.float32)


def test_clips_without_a_chunk_are_not_drawn_and_if_all_are_it_is_told(clips: Clips) -> None:
    short = clips.select(np.array([False, False, True, False, False]))
    with pytest.raises(ValueError, match="no clip has 10 frames"):
        EpisodeSource(short, CONFIG)


def test_rare_people_and_rare_motions_are_drawn_more_often_but_never_without_end(
    clips: Clips,
) -> None:
    people = np.repeat(clips.subjects, np.diff(clips.start))
    frames = len(clips)
    weights = frame_weights(clips, CarriedSettings()) * frames
    assert weights.max() <= 8.0 * weights.mean() * (1.0 + 1e-9) * frames
    by_frames = (people == "b").mean()
    alike = CarriedSettings(people_power=0.0, motion_power=1.0)
    assert frame_weights(clips, alike)[people == "b"].sum() == pytest.approx(0.5)
    equal = CarriedSettings(people_power=1.0, motion_power=1.0)
    assert frame_weights(clips, equal)[people == "b"].sum() == pytest.approx(by_frames)
    default = frame_weights(clips, CarriedSettings())[people == "b"].sum()
    assert by_frames < default < 0.5


def test_standing_and_walking_are_different_kinds_and_heading_does_not_matter() -> None:
    walk, still = walking(4.0, turn_rad_s=0.0), arms_down(4.0)
    kinds = kinds_of_motion(Clips.of([walk, still]))
    n = len(walk.p_hips)
    assert len(set(kinds[20 : n - 20])) == 1
    assert set(kinds[n:]) == {0}
    assert kinds[n // 2] != 0
    turned = kinds_of_motion(Clips.of([walking(4.0, turn_rad_s=0.8)]))
    assert set(turned[20:-20]) == set(kinds[20 : n - 20])


def test_streams_play_episodes_one_after_another_and_say_where_one_begins(clips: Clips) -> None:
    source = EpisodeSource(clips, CONFIG)
    streams = Streams(source, CONFIG, Position.start(5))
    chunks = [streams.next_chunk() for _ in range(30)]
    for stream in range(5):
        played = np.concatenate([c.x[stream] for c in chunks])
        expected, begins = [], []
        for number in range(30):
            episode = source.draw(np.random.default_rng([CONFIG.seed, stream, number]))
            expected.append(episode.x)
            begins += [True] + [False] * (len(episode) // CONFIG.window - 1)
        assert (played == np.concatenate(expected)[: len(played)]).all()
        assert [bool(c.first[stream]) for c in chunks] == begins[:30]


def test_streams_go_on_from_a_position(clips: Clips) -> None:
    source = EpisodeSource(clips, CONFIG)
    streams = Streams(source, CONFIG, Position.start(5))
    for _ in range(13):
        streams.next_chunk()
    again = Streams(source, CONFIG, streams.position)
    for _ in range(10):
        a, b = streams.next_chunk(), again.next_chunk()
        for name in ("x", "pose", "contact", "yaw", "first"):
            assert (getattr(a, name) == getattr(b, name)).all()
