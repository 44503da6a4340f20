"""From motion files to the arrays that training reads, kept in a cache."""

import hashlib
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from lobstr_hw.errors import FileFormatError
from lobstr_hw.features import FEATURE_VERSION
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import ClipFile, find_clips, retarget
from lobstr_hw.skeleton import SKELETON_VERSION
from lobstr_hw.splits import Split, clip_name
from lobstr_hw.training.dataset import RATE_HZ, Clips, load_clips, save_clips

__all__ = ["describe", "gather", "part_of_clips"]


def gather(
    paths: Sequence[str | Path],
    split: Split,
    cache: Path,
    progress: Callable[[Iterable[Motion], int], Iterable[Motion]] = lambda motions, _: motions,
) -> Clips:
    """All clips of the split's train and validation parts that are found under ``paths``.

    Args:
        paths: files and folders.
        split: says which clips are wanted.
        cache: folder; retargeting is done once for the same files.
        progress: wraps the iteration, for a bar; gets the number of clips.
    """
    wanted = split.parts["train"] | split.parts["validation"]
    found = find_clips(paths)
    sets = {clip.set_name for clip in found if clip.name in wanted}
    # canonical frames are fitted from the clips given: more than the wanted ones makes them better
    files = [clip for clip in found if clip.set_name in sets]
    if not files:
        raise FileFormatError(
            f"none of the clips of the split {split.name!r} is in {', '.join(map(str, paths))}. "
            "A clip is named after its folder: FOLDER/clips/NAME.bvh is FOLDER/NAME."
        )
    path = cache / f"clips-{_fingerprint(files)}.npz"
    if path.is_file():
        return load_clips(path)
    motions = progress(retarget(files), len(files))
    clips = Clips.of(motion for motion in motions if clip_name(motion.name) in wanted)
    cache.mkdir(parents=True, exist_ok=True)
    save_clips(path.with_suffix(".partial"), clips)
    os.replace(path.with_suffix(".partial"), path)
    return clips


def _fingerprint(files: Iterable[ClipFile]) -> str:
    """Of the files' names, sizes and times and the versions of what is made of them."""
    digest = hashlib.sha256(f"{FEATURE_VERSION} {SKELETON_VERSION} {RATE_HZ}".encode())
    for clip in files:
        stat = clip.path.stat()
        digest.update(f"{clip.name} {stat.st_size} {stat.st_mtime_ns}\n".encode())
    return digest.hexdigest()[:16]


def part_of_clips(clips: Clips, split: Split, *parts: str) -> Clips:
    """The clips of one part of the split, or of several."""
    return clips.select(np.array([split.part_of(str(name)) in parts for name in clips.names]))


def describe(clips: Clips, split: Split) -> dict[str, object]:
    """What a run was trained on, for the card: minutes and clips by set."""
    minutes: dict[str, float] = {}
    for name, frames in zip(clips.names, np.diff(clips.start), strict=True):
        folder = str(name).split("/")[0]
        minutes[folder] = minutes.get(folder, 0.0) + float(frames) / RATE_HZ / 60.0
    return {
        "split": split.name,
        "clips": len(clips.names),
        "subjects": sorted({str(s) for s in clips.subjects}),
        "minutes_by_set": {folder: round(value, 1) for folder, value in minutes.items()},
    }
