"""Is a slipped tracker noticed in the session, and how often is somebody warned of nothing?

    python tools/slip_watch_table.py CLIP.bvh ... --users 40 --seed 9000 [--write]

Sessions of simulated users: half a minute of standing at ease, and recorded motion.
"""

import argparse
import datetime
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from results_page import shown, write_section
from self_check_table import (
    RATE_HZ,
    _good_take,
    _lower,
    _round_the_belt,
    _same,
    _turned,
    wilson,
)

from lobstr_hw.calibration import (
    Calibration,
    TPoseDetector,
    movement_from_samples,
    refine_by_movement,
)
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.runtime.slip_watch import SlipWatch
from lobstr_hw.simulation import (
    PoseDeviation,
    SimulatedTake,
    SimulatedUser,
    Sway,
    simulate,
    take_samples,
)
from lobstr_hw.simulation.mishaps import arms_off_level
from lobstr_hw.simulation.t_pose import t_pose_motion

TITLE = "## Slipped trackers during a session"
STANDING_S = 30.0
CLIP_S = 60.0
CHANGES = {
    "nothing changed": _same,
    "pelvis tracker 5 cm lower": _lower,
    "pelvis tracker turned by 20 degrees": _turned,
    "pelvis tracker 6 cm round the belt": _round_the_belt,
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", nargs="+", type=Path)
    parser.add_argument("--users", type=int, default=30)
    parser.add_argument("--seed", type=int, default=9000)
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    clips = _recorded(args.clips)
    profiles = {}
    for seed in range(args.seed, args.seed + args.users):
        take = _good_take(seed)
        found = _profile(take)
        if found is not None:
            profiles[seed] = (take, found)
    rows = ["| | warned | of | share, 95 % interval | after, median |", "|---|---|---|---|---|"]
    for name, change in CHANGES.items():
        motions = {seed: _standing(seed) for seed in profiles}
        told = [
            _warned_s(profile, _later(motions[seed], seed, change(take.user, seed)))
            for seed, (take, profile) in profiles.items()
        ]
        rows.append(_row(f"standing {STANDING_S:.0f} s, {name}", told))
        print(rows[-1], flush=True)
    for name in list(CHANGES)[:2]:
        pairs = zip(profiles.items(), clips, strict=False)
        told = [
            _warned_s(profile, _later(clip, seed, CHANGES[name](take.user, seed)))
            for (seed, (take, profile)), clip in pairs
        ]
        rows.append(_row(f"recorded motion, {CLIP_S:.0f} s each, {name}", told))
        print(rows[-1], flush=True)
    text = "\n".join([_head(args), *rows, ""])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _recorded(paths: Sequence[Path]) -> list[Motion]:
    motions = [m for m in retarget(find_clips(paths)) if m.duration_s >= CLIP_S]
    n = round(CLIP_S * RATE_HZ)
    return [
        replace(m, p_hips=m.p_hips[:n], R_local=m.R_local[:n], p_toes=m.p_toes[:n]) for m in motions
    ]


def _profile(take: SimulatedTake) -> Calibration | None:
    samples = list(take_samples(take))
    pose = TPoseDetector({s: r for r, s in take.serials.items()}).add(samples)
    if pose is None:
        return None
    return refine_by_movement(
        pose, movement_from_samples(samples, pose.serials, pose.end_s)
    ).calibration


def _standing(seed: int) -> Motion:
    """At ease, a little otherwise than in the T-pose."""
    rng = np.random.default_rng([seed, 12])
    hanging = np.deg2rad(rng.normal(-72.0, 5.0, 2))
    deviation = arms_off_level(
        PoseDeviation.drawn(rng, np.deg2rad(7.0)), (float(hanging[0]), float(hanging[1]))
    )
    return t_pose_motion(STANDING_S, RATE_HZ, deviation, Sway(), rng)


def _later(motion: Motion, seed: int, user: SimulatedUser) -> SimulatedTake:
    """The motion by this user, some time later."""
    return simulate(motion, seed + 77_000_000, rate_hz=RATE_HZ, user=user, t_pose_s=0.0)


def _warned_s(profile: Calibration, take: SimulatedTake) -> float | None:
    """When the watch speaks; None if it does not."""
    watch, samples = SlipWatch(), list(take_samples(take))
    edges = np.searchsorted([s.time_s for s in samples], take.times_s, side="right")
    for (begin, end), now_s in zip(pairwise([0, *edges.tolist()]), take.times_s, strict=True):
        if watch.add(float(now_s), samples[begin:end], profile):
            return float(now_s)
    return None


def _row(name: str, told: Sequence[float | None]) -> str:
    times = [t for t in told if t is not None]
    n, k = len(told), len(times)
    low, high = wilson(k, n)
    after = f"{np.median(times):.0f} s" if times else ""
    share = f"{100.0 * k / n:.1f} % ({100.0 * low:.1f} to {100.0 * high:.1f})"
    return f"| {name} | {k} | {n} | {share} | {after} |"


def _head(args: argparse.Namespace) -> str:
    clips = " ".join(shown(path) for path in args.clips)
    command = f"python tools/slip_watch_table.py {clips} --users {args.users} --seed {args.seed}"
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

Simulated users as under Self-check, calibrated by T-pose and movement. Later they stand at ease for
half a minute, or do what was recorded; "warned" counts users who were warned at all.

`{command}`, {date}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
