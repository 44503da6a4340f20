"""What a track looks like to someone who wonders whether a log is any good."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.drivers.tracker_log.tracks import TrackerTrack
from lobstr_hw.rotations import Array

__all__ = ["Quality", "dropouts", "jumps", "quality", "sample_rate"]

GAP_PERIODS = 3.0
"""So many periods without a sample are a gap, and not just a late packet."""
JUMP_M = 0.02
"""Off the straight line through the two samples before."""
JUMP_WINDOW_S = 0.025
"""Samples further apart than 25 ms say nothing about jumps: a hand may do that."""


@dataclass(frozen=True, slots=True, eq=False)
class Quality:
    """Numbers about one track.

    Attributes:
        samples: how many.
        rate_hz: by the median distance of samples; 0 for fewer than two.
        dropouts_s: (n, 2) begin and end of each time without sight or without samples.
        jumps_s: (n,) times of sudden steps.
        broken: samples with a number that is none.
    """

    samples: int
    rate_hz: float
    dropouts_s: Array
    jumps_s: Array
    broken: int

    @property
    def lost_s(self) -> float:
        """All drop-outs together."""
        return float(np.sum(self.dropouts_s[:, 1] - self.dropouts_s[:, 0]))


def quality(track: TrackerTrack) -> Quality:
    """Count samples, drop-outs, jumps and broken samples."""
    bad_p = track.has_p & np.isnan(track.p.sum(axis=1))
    broken = int(np.sum(bad_p | np.isnan(track.quat_xyzw.sum(axis=1))))
    return Quality(len(track), sample_rate(track.times_s), dropouts(track), jumps(track), broken)


def sample_rate(times_s: Array) -> float:
    """Samples per second by the median distance, to 0.001 Hz; 0 for fewer than two.

    Times are whole nanoseconds, so more digits than these would be noise.
    """
    steps = np.diff(times_s)
    steps = steps[steps > 0.0]
    return round(float(1.0 / np.median(steps)), 3) if len(steps) else 0.0


def dropouts(track: TrackerTrack) -> Array:
    """Begin and end (n, 2) of each time without sight, or without samples."""
    times = track.times_s
    if len(times) < 2:
        return np.zeros((0, 2))
    longest = GAP_PERIODS / max(sample_rate(times), 1e-9)
    # what lies between two samples is lost when the first was not tracked, or the second is late
    lost = ~track.tracked[:-1] | (np.diff(times) > longest)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lost.astype(np.int8), [0]])))
    return np.asarray(times[edges.reshape(-1, 2)])


def jumps(track: TrackerTrack) -> Array:
    """Times (n,) at which a tracked position leaves the straight line by more than 2 cm.

    Two centimetres within 11 ms is 160 m/s^2; a tracker that comes back from a jump counts too, but
    not within 25 ms of the last.
    """
    t, p = track.times_s, track.p
    if len(t) < 3:
        return np.zeros(0)
    ahead, behind = t[2:] - t[1:-1], t[1:-1] - t[:-2]
    near = (ahead < JUMP_WINDOW_S) & (behind < JUMP_WINDOW_S) & (behind > 0.0)
    seen = track.tracked[2:] & track.tracked[1:-1] & track.tracked[:-2]
    slope = (p[1:-1] - p[:-2]) / np.where(behind > 0.0, behind, 1.0)[:, None]
    off = np.linalg.norm(p[2:] - p[1:-1] - slope * ahead[:, None], axis=1)
    found = t[2:][near & seen & (off > JUMP_M)]
    apart = np.diff(found, prepend=-np.inf) > JUMP_WINDOW_S
    return np.asarray(found[apart])
