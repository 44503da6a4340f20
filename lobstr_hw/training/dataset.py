"""Clips as flat arrays, and the windows that are drawn from them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lobstr_hw.contact_labels import contact_labels, paper_contact_labels
from lobstr_hw.features import (
    POINT_JOINTS,
    Form,
    clip_features,
    clip_points,
    features,
    mirror_features,
    reference_frames,
)
from lobstr_hw.lower_body import mirror_pose_6d, pose_6d, true_lower_body
from lobstr_hw.motion import Motion
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Joint
from lobstr_hw.training.augmentation import Augmentation, add_tracker_errors
from lobstr_hw.training.config import TrainingConfig

__all__ = [
    "Clips",
    "Statistics",
    "Windows",
    "draw_windows",
    "load_clips",
    "save_clips",
    "statistics",
]

Float32 = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]
RATE_HZ = 45.0
SMALLEST_DEVIATION = 1e-3
"""A channel that hardly moves in training must not explode when it does move."""


@dataclass(frozen=True, slots=True, eq=False)
class Clips:
    """Clips one after another at 45 Hz on the standard skeleton.

    Attributes:
        names: (clips,) ``set/clip``.
        subjects: (clips,) the persons.
        start: (clips + 1,) where each clip begins; the last entry is the end.
        p: (frames, 4, 3) the points of the features, world.
        R: (frames, 4, 3, 3).
        pose: (frames, 48) the truth.
        contact: (frames, 2) by height over a local floor, and speed.
        paper_contact: (frames, 2) by the paper's 1 cm.
    """

    names: npt.NDArray[np.str_]
    subjects: npt.NDArray[np.str_]
    start: npt.NDArray[np.int64]
    p: Float32
    R: Float32
    pose: Float32
    contact: Bools
    paper_contact: Bools

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.p)

    @staticmethod
    def of(motions: Iterable[Motion]) -> "Clips":
        """Gather motions (at 45 Hz)."""
        rows = [_clip_arrays(motion) for motion in motions]
        columns = [
            np.concatenate(column) for column in zip(*(row[2:] for row in rows), strict=True)
        ]
        lengths = [len(row[2]) for row in rows]
        start = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
        return Clips(
            np.array([row[0] for row in rows]), np.array([row[1] for row in rows]), start, *columns
        )

    def select(self, chosen: Bools) -> "Clips":
        """The clips where ``chosen`` (clips,) is True."""
        index = [np.arange(a, b) for a, b in zip(self.start[:-1], self.start[1:], strict=True)]
        kept = [index[i] for i in np.flatnonzero(chosen)]
        frames = np.concatenate(kept) if kept else np.zeros(0, dtype=np.int64)
        start = np.concatenate([[0], np.cumsum([len(k) for k in kept])]).astype(np.int64)
        arrays = (a[frames] for a in (self.p, self.R, self.pose, self.contact, self.paper_contact))
        return Clips(self.names[chosen], self.subjects[chosen], start, *arrays)


def _clip_arrays(
    motion: Motion,
) -> tuple[str, str, Float32, Float32, Float32, Bools, Bools]:
    if motion.rate_hz != RATE_HZ:
        raise ValueError(f"{motion.name}: {motion.rate_hz} Hz, training needs {RATE_HZ}")
    p, R = motion.joints()
    truth = true_lower_body(motion.R_local, reference_frames(R[:, Joint.HIPS]))
    return (
        motion.name,
        motion.subject,
        p[:, POINT_JOINTS].astype(np.float32),
        R[:, POINT_JOINTS].astype(np.float32),
        pose_6d(truth).astype(np.float32),
        contact_labels(motion.p_toes, motion.rate_hz),
        paper_contact_labels(motion.p_toes),
    )


def save_clips(path: Path, clips: Clips) -> None:
    """Write a cache file."""
    with path.open("wb") as file:
        np.savez(file, **{f.name: getattr(clips, f.name) for f in fields(Clips)})


def load_clips(path: Path) -> Clips:
    """Read a cache file."""
    with np.load(path, allow_pickle=False) as arrays:
        return Clips(**{f.name: arrays[f.name] for f in fields(Clips)})


@dataclass(frozen=True, slots=True, eq=False)
class Statistics:
    """Of the training clips: input mean and deviation, output mean, share of contacts."""

    input_mean: Float32
    input_scale: Float32
    output_mean: Float32
    contact_mean: Float32


def statistics(clips: Clips, config: TrainingConfig) -> Statistics:
    """Of the undisturbed clips, with their mirror images when these are trained on."""
    starts = zip(clips.start[:-1], clips.start[1:], strict=True)
    x = np.concatenate([_clip_features(clips, a, b, config.feature_form) for a, b in starts])
    pose, contact = clips.pose.astype(np.float64), _labels(clips, config)
    if config.mirror:
        x = np.concatenate([x, mirror_features(x)])
        pose = np.concatenate([pose, mirror_pose_6d(pose)])
        contact = np.concatenate([contact, contact[:, ::-1]])
    return Statistics(
        input_mean=x.mean(axis=0).astype(np.float32),
        input_scale=np.maximum(x.std(axis=0), SMALLEST_DEVIATION).astype(np.float32),
        output_mean=pose.mean(axis=0).astype(np.float32),
        contact_mean=contact.mean(axis=0).astype(np.float32),
    )


def _clip_features(clips: Clips, first: int, end: int, form: Form) -> Array:
    p, R = clips.p[first:end].astype(np.float64), clips.R[first:end].astype(np.float64)
    return clip_features(clip_points(p, R, form=form), form)


def _labels(clips: Clips, config: TrainingConfig) -> Bools:
    return clips.contact if config.contact_label == "floor" else clips.paper_contact


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """A batch: input (n, window, 37) not yet z-scored, and the truth at the last frame."""

    x: Float32
    pose: Float32
    pose_before: Float32
    contact: npt.NDArray[np.int64]


def draw_windows(
    clips: Clips,
    n: int,
    config: TrainingConfig,
    augmentation: Augmentation,
    rng: np.random.Generator,
) -> Windows:
    """Draw clips in proportion to their frames, then a window of each (the paper's appendix 3)."""
    length = np.diff(clips.start)
    weight = np.where(length > config.window, length, 0).astype(np.float64)
    if not weight.any():
        raise ValueError(f"no clip is longer than {config.window} frames")
    clip = rng.choice(len(length), size=n, p=weight / weight.sum())
    # one frame more in front: the first velocity of a window is a true one
    first = clips.start[clip] + rng.integers(0, length[clip] - config.window)
    frames = first[:, None] + np.arange(config.window + 1)
    x = _window_features(clips, frames, config.feature_form, augmentation, rng)
    last = frames[:, -1]
    windows = Windows(
        x.astype(np.float32),
        clips.pose[last],
        clips.pose[last - 1],
        _labels(clips, config)[last].astype(np.int64),
    )
    return _some_mirrored(windows, rng.random(n) < 0.5) if config.mirror else windows


def _window_features(
    clips: Clips,
    frames: npt.NDArray[np.int64],
    form: Form,
    augmentation: Augmentation,
    rng: np.random.Generator,
) -> Array:
    """Features (n, window, 37) of frames (n, window + 1)."""
    time_first = frames.T
    p, R = clips.p[time_first].astype(np.float64), clips.R[time_first].astype(np.float64)
    p, R = add_tracker_errors(p, R, RATE_HZ, augmentation, rng)
    points = clip_points(p, R, form=form)
    linked = np.ones((len(p) - 1, p.shape[1]), dtype=bool)
    x = features(points.take(slice(None, -1)), points.take(slice(1, None)), linked, form)
    return np.swapaxes(x, 0, 1)


def _some_mirrored(windows: Windows, which: Bools) -> Windows:
    def either(values: Float32, mirror: Callable[[Array], Array]) -> Float32:
        at = which.reshape(-1, *(1,) * (values.ndim - 1))
        return np.where(at, mirror(values.astype(np.float64)), values).astype(np.float32)

    return Windows(
        either(windows.x, mirror_features),
        either(windows.pose, mirror_pose_6d),
        either(windows.pose_before, mirror_pose_6d),
        np.where(which[:, None], windows.contact[:, ::-1], windows.contact),
    )
