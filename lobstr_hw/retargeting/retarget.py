"""Clips of any rig onto the standard skeleton, 45 Hz, floor at y = 0 (docs/retargeting.md)."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lobstr_hw.motion import Motion
from lobstr_hw.retargeting.canonical import CanonicalFrames, canonical_rotations, fit_frames
from lobstr_hw.retargeting.clips import ClipFile, Fault, own_faults
from lobstr_hw.retargeting.cuts import bad_frames, good_pieces
from lobstr_hw.retargeting.floor import floor_height
from lobstr_hw.retargeting.legs import solve_legs
from lobstr_hw.retargeting.resample import resample_points, resample_rotations, resample_times
from lobstr_hw.retargeting.source import LEGS, SourceClip, load_source, same_rig
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint, local_rotations

__all__ = ["RATE_HZ", "Note", "Progress", "retarget", "retarget_clip"]

RATE_HZ = 45.0

Progress = Callable[[int, int, str], None]
"""Called after each clip: clips done, clips in all, name of the clip."""

_EVIDENCE_FRAMES = 20_000
_ON_FEET_M = (0.15, 0.45)
"""Height of the hip joints over the floor from which the feet carry none, and all, of the body."""
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
    clips of a subject in one call. The clips come out grouped by rig and subject.

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
    good = [c for c in clips if c.name not in dropped]
    done = len(left_out)
    for rig in same_rig(good):
        whole: list[CanonicalFrames] = []
        for members in _by_subject(rig):
            frames = _fit(members, rig, whole, say)
            for clip in members:
                cuts = [f for f in by_clip.get(clip.name, ()) if f.action == "cut"]
                yield from retarget_clip(clip, load_source(clip), frames, cuts)
                done += 1
                if progress:
                    progress(done, len(clips), clip.name)


def _by_subject(rig: Sequence[ClipFile]) -> list[list[ClipFile]]:
    """Clips of one subject; styles of one actor ("...; style old") count as one."""
    out: dict[str, list[ClipFile]] = {}
    for clip in rig:
        out.setdefault(clip.subject.split(";")[0], []).append(clip)
    return list(out.values())


def _fit(
    members: Sequence[ClipFile],
    rig: Sequence[ClipFile],
    whole: list[CanonicalFrames],
    say: Callable[[Note], None],
) -> CanonicalFrames:
    """The frames of one subject; what it shows too little of comes from everybody on this rig.

    Args:
        members: clips of the subject.
        rig: clips of everybody.
        whole: the frames fitted from everybody, once they were needed (filled here).
        say: called with each note.
    """
    sources = _evidence(members)
    frames = fit_frames(sources)
    if frames.notes and len(members) < len(rig):
        if not whole:
            whole.append(fit_frames(_evidence(rig)))
        frames = fit_frames(sources, whole[0])
    how = "from everybody on this rig" if whole else "from what there is"
    for text in frames.notes:
        say(Note(members[0].name, f"{members[0].subject}: {text}: frames {how}"))
    if not sources[0].unit_told:
        say(Note(members[0].name, f"unit guessed from the legs: hips at {sources[0].metres:.2f} m"))
    return frames


def _evidence(members: Sequence[ClipFile]) -> list[SourceClip]:
    """Clips spread evenly over the members, as many as are enough."""
    sources: list[SourceClip] = []
    budget = float(_EVIDENCE_FRAMES)
    # golden ratio: every beginning of this order is spread evenly
    rank = np.array([(i * 0.6180339887498949) % 1.0 for i in range(len(members))])
    for i in np.argsort(rank, kind="stable"):
        sources.append(load_source(members[i]))
        budget -= len(sources[-1]) * min(1.0, 30.0 / sources[-1].rate_hz)
        if budget < 0.0:
            break
    return sources


def retarget_clip(
    clip: ClipFile, source: SourceClip, frames: CanonicalFrames, cuts: Sequence[Fault] = ()
) -> list[Motion]:
    """One clip onto the standard skeleton; several Motions where it is cut."""
    R_local = local_rotations(canonical_rotations(source, frames))
    shift = 0.0 if source.standard else floor_height(source.p[:, _TOES], source.rate_hz)
    p_toes = source.p[:, _TOES] - [0.0, shift, 0.0]
    centre = source.hip_centre() - [0.0, shift, 0.0]
    pieces = [(0, len(source))]
    if cuts:
        p_hips = _hips(centre, R_local[:, Joint.HIPS], frames.lift)
        bad = bad_frames(solve_legs(R_local, p_hips, p_toes), source.rate_hz, cuts)
        pieces = good_pieces(bad, source.rate_hz)
    out = []
    for k, (a, b) in enumerate(pieces):
        at = resample_times(b - a, source.rate_hz, RATE_HZ)
        R = resample_rotations(R_local[a:b], at)
        toes = resample_points(p_toes[a:b], at)
        p_hips = _hips(resample_points(centre[a:b], at), R[:, Joint.HIPS], frames.lift)
        name = f"{clip.name}#{k}" if cuts else clip.name
        R = solve_legs(R, p_hips, toes)
        out.append(Motion(name, clip.subject, RATE_HZ, p_hips, R, toes, source.metres))
    return out


def _hips(centre: Array, R_hips: Array, lift: float) -> Array:
    """The hips joint stands over the middle of the hip joints, as far as on the standard skeleton.

    ``lift`` makes up for the ankle's height; a body that lies or sits on the floor has none.
    """
    over = -STANDARD_OFFSETS[Joint.LEFT_UPPER_LEG] * [0.0, 1.0, 1.0]
    low, high = _ON_FEET_M
    on_feet = np.clip((centre[:, 1] - low) / (high - low), 0.0, 1.0)
    p = centre + R_hips @ over
    p[:, 1] += lift * on_feet
    return np.asarray(p)
