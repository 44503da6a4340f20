"""Clips by name, or by their part of the split, for the tools that measure on them."""

from collections.abc import Collection, Iterator
from pathlib import Path

from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.splits import clip_name, default_split


def motions_named(data: Path, wanted: Collection[str]) -> Iterator[Motion]:
    """The clips of these names, SET/CLIP, with all their pieces.

    Args:
        data: folder with one folder per set; a person's skeleton is fitted on all of a set's clips.
        wanted: their names.
    """
    sets = {name.split("/")[0] for name in wanted}
    found = [clip for clip in find_clips([data]) if clip.set_name in sets]
    return (motion for motion in retarget(found) if clip_name(motion.name) in wanted)


def part_motions(data: Path, part: str) -> Iterator[Motion]:
    """The clips of a part of the project's own split."""
    return motions_named(data, default_split().parts[part])


def truths(data: Path, part: str) -> Iterator[Truth]:
    """The same as lobstr-evaluate has them."""
    return map(Truth.of, part_motions(data, part))
