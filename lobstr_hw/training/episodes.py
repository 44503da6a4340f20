"""Long pieces of clips as a person with trackers would give them, drawn one after another.

An episode is some chunks of one clip: at its own speed or another, mirrored or not, with trackers
off their joints, drifting, and now and then lost. All of it is drawn from one generator.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lobstr_hw.features import (
    POINT_ROLES,
    Bools,
    Points,
    clip_features,
    clip_points,
    mirror_features,
    reference_frames,
)
from lobstr_hw.lower_body import mirror_pose_6d, pose_6d, pose_from_6d
from lobstr_hw.predictors.mended import mended
from lobstr_hw.rotations import Array, from_6d, heading_angle, to_6d
from lobstr_hw.trackers import TrackerRole
from lobstr_hw.training.augmentation import add_tracker_errors
from lobstr_hw.training.balance import frame_weights
from lobstr_hw.training.config import CarriedSettings, TrainingConfig
from lobstr_hw.training.dataset import RATE_HZ, Clips, Float32
from lobstr_hw.training.sitting import sat_down
from lobstr_hw.training.strides import Stride, with_other_strides

__all__ = ["Episode", "EpisodeSource"]

DROPOUT_S = (0.1, 1.5)
HIPS, UP = POINT_ROLES.index(TrackerRole.PELVIS), 1


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """Frames in a row; a whole number of chunks.

    Attributes:
        x: (frames, 37) not yet z-scored; the first frame has nothing to difference with.
        pose: (frames, 48) the truth.
        contact: (frames, 2) 0 or 1.
        yaw: (frames,) of the true reference frame, radians.
    """

    x: Float32
    pose: Float32
    contact: npt.NDArray[np.int64]
    yaw: Float32

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.x)

    def mirrored(self) -> "Episode":
        """Left and right exchanged."""
        return Episode(
            mirror_features(self.x.astype(np.float64)).astype(np.float32),
            mirror_pose_6d(self.pose.astype(np.float64)).astype(np.float32),
            self.contact[:, ::-1],
            -self.yaw,
        )


class EpisodeSource:
    """Clips to draw episodes from; what is drawn depends on the generator only."""

    def __init__(self, clips: Clips, config: TrainingConfig) -> None:
        """Weigh the frames of the clips that hold a chunk.

        Raises:
            ValueError: no clip does.
        """
        length = np.diff(clips.start)
        weights = frame_weights(clips, config.carried) * np.repeat(length >= config.window, length)
        if not weights.any():
            raise ValueError(f"no clip has {config.window} frames")
        self._clips, self._config = clips, config
        self._cumulated = np.cumsum(weights)

    def draw(self, rng: np.random.Generator) -> Episode:
        """The next episode."""
        clip, times = self._piece(rng)
        p, R, pose, contact = self._at(clip, times)
        share = self._config.carried.sitting_share
        if share > 0.0 and rng.random() < share:
            p, R, pose = sat_down(p, R, pose, RATE_HZ, rng)
        share = self._config.carried.stride_share
        if share > 0.0 and rng.random() < share:
            p, pose = with_other_strides(p, R, pose, contact, RATE_HZ, Stride.drawn(rng))
        yaw = heading_angle(reference_frames(R[:, 0]))[0]
        x = self._features(p, R, rng)
        episode = Episode(
            x.astype(np.float32), pose.astype(np.float32), contact, yaw.astype(np.float32)
        )
        return episode.mirrored() if self._config.mirror and rng.random() < 0.5 else episode

    def _piece(self, rng: np.random.Generator) -> tuple[int, Array]:
        """A clip, and the times in it (in its frames, need not be whole) that are played."""
        clips, settings, window = self._clips, self._config.carried, self._config.window
        anchor = np.searchsorted(self._cumulated, rng.random() * self._cumulated[-1], side="right")
        clip = int(np.searchsorted(clips.start, anchor, side="right")) - 1
        length = int(clips.start[clip + 1] - clips.start[clip])
        speed = _speed(settings, rng)
        if (window - 1) * speed > length - 1:
            speed = 1.0
        longest = int(((length - 1) / speed + 1.0) // window)
        frames = window * min(longest, int(rng.geometric(1.0 / settings.mean_chunks)))
        span = (frames - 1) * speed
        first = anchor - clips.start[clip] - rng.random() * span
        first = round(float(np.clip(first, 0.0, np.floor(length - 1 - span))))
        return clip, first + speed * np.arange(frames, dtype=np.float64)

    def _at(self, clip: int, times: Array) -> tuple[Array, Array, Array, npt.NDArray[np.int64]]:
        """Points, poses and labels of a clip at times."""
        clips = self._clips
        start, last = clips.start[clip], clips.start[clip + 1] - 1
        before = start + np.floor(times).astype(np.int64)
        after = np.minimum(before + 1, last)
        part = times - np.floor(times)
        labels = clips.contact if self._config.contact_label == "floor" else clips.paper_contact
        contact = labels[np.where(part < 0.5, before, after)].astype(np.int64)
        p, R, pose = (a[before].astype(np.float64) for a in (clips.p, clips.R, clips.pose))
        if part.any():
            p = _between(p, clips.p[after], part)
            R = from_6d(_between(to_6d(R), to_6d(clips.R[after]), part))
            pose = pose_6d(pose_from_6d(_between(pose, clips.pose[after], part)))
        return p, R, pose, contact

    def _features(self, p: Array, R: Array, rng: np.random.Generator) -> Array:
        config, settings = self._config, self._config.carried
        lever = settings.lever_m * rng.standard_normal((p.shape[1], 3, 1))
        lever[HIPS, UP] = 0.0
        p = p + (R @ lever)[..., 0]
        p, R = add_tracker_errors(p, R, RATE_HZ, config.augmentation, rng)
        points = clip_points(p, R, form=config.feature_form)
        if rng.random() < settings.dropout_share:
            points = _with_a_gap(points, rng)
        return clip_features(points, config.feature_form)


def _speed(settings: CarriedSettings, rng: np.random.Generator) -> float:
    if rng.random() >= settings.warp_share:
        return 1.0
    return float(np.exp(rng.uniform(np.log(settings.warp_min), np.log(settings.warp_max))))


def _between(a: Array, b: Array, part: Array) -> Array:
    weight = part.reshape(-1, *(1,) * (a.ndim - 1))
    return np.asarray(a + weight * (b - a))


def _dropout(frames: int, rng: np.random.Generator) -> Bools:
    """Validity (frames, 4) with one role lost once, never in the first frame."""
    valid = np.ones((frames, len(POINT_ROLES)), dtype=bool)
    first = int(rng.integers(1, frames))
    lost = round(rng.uniform(*DROPOUT_S) * RATE_HZ)
    valid[first : first + lost, rng.integers(len(POINT_ROLES))] = False
    return valid


def _with_a_gap(points: Points, rng: np.random.Generator) -> Points:
    """Points (frames, 4, ...) of which one is lost once: guessed, as it is live meanwhile.

    In half of them the gap is mended, as the live network's past is once the point is back.
    """
    valid = _dropout(len(points.p), rng)
    back = np.full(len(valid), rng.random() < 0.5)
    return mended(replace(points, valid_p=valid, valid_R=valid), linked=back)
