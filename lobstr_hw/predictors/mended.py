"""A recording in which points are lost now and then: both ends of each gap are known.

What :mod:`lobstr_hw.predictors.bridge` makes of the past when a point comes back, in the points
themselves. Where nothing comes back in time they are guessed, as they are live.
"""

from dataclasses import replace

import numpy as np

from lobstr_hw.features import Bools, Points, reference_frames
from lobstr_hw.lost_points import follow
from lobstr_hw.predictors.bridge import NEVER, bent, gap_part, gone_on
from lobstr_hw.predictors.gap_memory import FRAMES, Ints
from lobstr_hw.rotations import Array

__all__ = ["mended"]


def mended(points: Points, linked: Bools) -> Points:
    """One person's points (frames, 4, ...); in a gap that was bridged they count as measured.

    Args:
        points: at the networks' rate, as they were recorded; their reference frames do not matter.
        linked: (frames,) whether the frame before is one step ago.
    """
    p, R = points.p.copy(), points.R.copy()
    out = Points(p, R, points.valid_p.copy(), points.valid_R.copy(), points.R_ref)
    seen = points.valid_p & points.valid_R
    lost = _steps_lost(seen)
    for i in (np.flatnonzero(~(seen[1:] & seen[:-1]).all(axis=-1)) + 1).tolist():
        last, now, steps = out.take([i - 1]), out.take([i]), lost[i - 1]
        back = seen[i] & (steps > 0) & (steps < FRAMES)
        ends = [r for r in np.flatnonzero(back).tolist() if linked[i - steps[r] : i + 1].all()]
        if ends:
            guess = gone_on(last, now, (steps < NEVER)[None])
            for r in ends:
                _bend(
                    out,
                    r,
                    slice(i - steps[r], i),
                    p[i, r] - guess.p[0, r],
                    R[i, r] @ guess.R[0, r].T,
                )
        now = follow(out.take([i - 1]), now, (steps < NEVER)[None])
        p[i], R[i] = now.p[0], now.R[0]
    return replace(out, R_ref=reference_frames(R[:, 0]))


def _steps_lost(seen: Bools) -> Ints:
    """Frames (frames, 4) since each point was last seen, up to FRAMES; NEVER if it never was."""
    at = np.arange(len(seen))[:, None]
    last = np.maximum.accumulate(np.where(seen, at, -1), axis=0)
    return np.where(last < 0, NEVER, np.minimum(at - last, FRAMES))


def _bend(points: Points, role: int, gap: slice, off_p: Array, off_R: Array) -> None:
    """Lead a point over a gap to where it is seen again, in place."""
    p, R = points.p[gap, role], points.R[gap, role]
    parts = gap_part(points.valid_p[gap, role]), gap_part(points.valid_R[gap, role])
    p[...], R[...] = bent(p, R, off_p, off_R, *parts)
    points.valid_p[gap, role] = points.valid_R[gap, role] = True
