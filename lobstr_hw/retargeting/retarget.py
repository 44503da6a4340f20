"""Clips of any rig onto the standard skeleton, at 45 Hz, on a floor at y = 0 (docs/retargeting.md)."""

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.retargeting.canonical import CanonicalFrames, canonical_rotations, fit_frames
from lobstr_hw.retargeting.clips import ClipFile, Fault, own_faults
from lobstr_hw.retargeting.cuts import good_pieces
from lobstr_hw.retargeting.floor import floor_height
from lobstr_hw.retargeting.legs import solve_legs
from lobstr_hw.retargeting.resample import resample_points, resample_rotations, resample_times
from lobstr_hw.retargeting.source import LEGS, SourceClip, load_source
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint, local_rotations

__all__ = ["RATE_HZ", "Note", "Progress", "retarget", "retarget_clip"]

RATE_HZ = 45.0

Progress = Callable[[int, int, str], None]
"""Called after each clip: clips done, clips in all, name of the clip."""

_EVIDENCE_FRAMES = 20_000
_TOES = [leg[3] for leg in LEGS]


@dataclass(frozen=True, slots=True)
class Note:
    """Something a user of a retargeted clip may want to know: a fall-back, a clip left out."""

    clip: str
    text: str


def retarget(
    clips: Sequence[ClipFile],
    faults: Sequence[Fault] | None = None,
    progress: Progress | None = None,
    notes: Callable[[Note], None] | None = None,
) -> Iterator[Motion]:
    """Bring clips to the standard skeleton at 45 Hz.

    Canonical frames are fitted per subject and rig from the given clips themselves, so give all
    clips of a subject in one call. The clips come out grouped by subject and rig.

    Args:
        clips: from :func:`lobstr_hw.retargeting.find_clips`.
        faults: what is wrong with clips; the project's own list when left out.
        progress: called after each clip.
        notes: called with each :class:`Note`.

    Yields:
        One Motion a clip; of a cut clip one a piece, named ``...#0``, ``...#1``.

    Raises:
        MotionFileError: a clip cannot be read.
        UnknownRig: a clip's joints have no table.
    """
    say = notes or (lambda note: None)
    by_clip: dict[str, list[Fault]] = {}
    for fault in own_faults() if faults is None else faults:
        by_clip.setdefault(f"{fault.set_name}/{fault.clip}", []).append(fault)
    left_out = [c for c in clips if any(f.action == "leave_out" for f in by_clip.get(c.name, ()))]
    for clip in left_out:
        say(Note(clip.name, "left out: " + "; ".join(f.why for f in by_clip[clip.name])))
    dropped = {c.name for c in left_out}
    groups: dict[str, list[ClipFile]] = {}
    for clip in clips:
        if clip.name not in dropped:
            groups.setdefault(_group(clip), []).append(clip)
    done = len(left_out)
    for members in groups.values():
        frames = _fit_group(members, say)
        for clip in members:
            cuts = [f for f in by_clip.get(clip.name, ()) if f.action == "cut"]
            yield from retarget_clip(clip, load_source(clip), frames, cuts)
            done += 1
            if progress:
                progress(done, len(clips), clip.name)


def _group(clip: ClipFile) -> str:
    """Clips that share canonical frames: one subject (styles apart count as one) on one rig."""
    head = clip.path.read_bytes()[:20_000].partition(b"MOTION")[0]
    lines = [line.split() for line in head.splitlines()]
    # the root's offset is where the actor stood, not how the rig is made
    shape = [w for words in lines for w in words if words[0] in (b"ROOT", b"JOINT", b"OFFSET")]
    offsets = [i for i, w in enumerate(shape) if w == b"OFFSET"]
    shape[offsets[0] + 1 : offsets[0] + 4] = [] if offsets else []
    subject = clip.subject.split(";")[0]
    return f"{clip.set_name}|{subject}|{zlib.crc32(b' '.join(shape)):08x}"


def _fit_group(members: Sequence[ClipFile], say: Callable[[Note], None]) -> CanonicalFrames:
    """Fit from clips spread evenly over the group, as many as are enough."""
    sources: list[SourceClip] = []
    budget = float(_EVIDENCE_FRAMES)
    for clip in _spread(members):
        source = load_source(clip)
        sources.append(source)
        budget -= len(source) * min(1.0, 30.0 / source.rate_hz)
        if budget < 0.0:
            break
    frames = fit_frames(sources)
    for text in frames.notes:
        say(Note(members[0].name, f"{text} ({members[0].subject}, {len(members)} clips)"))
    if not sources[0].unit_told:
        say(Note(members[0].name, f"unit guessed from the legs: 1.0 m is {sources[0].metres:.3f} m"))
    return frames


def _spread(members: Sequence[ClipFile]) -> list[ClipFile]:
    """All members, in an order whose every beginning is spread evenly (golden ratio)."""
    rank = [(i * 0.6180339887498949) % 1.0 for i in range(len(members))]
    return [members[i] for i in np.argsort(np.array(rank), kind="stable")]


def retarget_clip(
    clip: ClipFile, source: SourceClip, frames: CanonicalFrames, cuts: Sequence[Fault] = ()
) -> list[Motion]:
    """One clip onto the standard skeleton; several Motions where it is cut."""
    R_local = local_rotations(canonical_rotations(source, frames))
    p_toes = source.p[:, _TOES]
    shift = 0.0 if source.standard else floor_height(p_toes, source.rate_hz)
    pieces = good_pieces(R_local, source.rate_hz, cuts) if cuts else [(0, len(source))]
    out = []
    for k, (a, b) in enumerate(pieces):
        at = resample_times(b - a, source.rate_hz, RATE_HZ)
        R = resample_rotations(R_local[a:b], at)
        centre = resample_points(source.hip_centre()[a:b], at)
        toes = resample_points(p_toes[a:b], at) - [0.0, shift, 0.0]
        p_hips = _hips(centre, R[:, Joint.HIPS]) + [0.0, frames.lift - shift, 0.0]
        name = f"{clip.name}#{k}" if cuts else clip.name
        R = solve_legs(R, p_hips, toes)
        out.append(Motion(name, clip.subject, RATE_HZ, p_hips, R, toes, source.metres))
    return out


def _hips(centre: Array, R_hips: Array) -> Array:
    """The hips joint stands over the middle of the hip joints, as far as on the standard skeleton."""
    up = -STANDARD_OFFSETS[Joint.LEFT_UPPER_LEG] * [0.0, 1.0, 1.0]
    return np.asarray(centre + R_hips @ up)
