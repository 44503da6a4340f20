"""How well a T-pose and a few seconds of movement calibrate: many simulated users.

    python tools/movement_table.py --users 500 --seed 5000 [--write]
    python tools/movement_table.py --users 100 --seed 5000 CLIP.bvh ...    recorded movement

Every user is calibrated twice, trackers on as they were, so that repeats can be compared. Seeds
under 1000 are for choosing, those from 5000 for reporting.
"""

import argparse
import datetime
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from results_page import shown, write_section

from lobstr_hw.calibration import (
    Calibration,
    TPoseDetector,
    calibrate_t_pose,
    movement_from_samples,
    refine_by_movement,
)
from lobstr_hw.calibration.heading import turn_between
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, geodesic_angle, heading_angle
from lobstr_hw.simulation import (
    Habits,
    Performance,
    SimulatedTake,
    calibrating_movement,
    drawn_user,
    simulate,
    take_samples,
)
from lobstr_hw.trackers import FOUR_POINTS

TITLE = "## Calibration with movement"
HEAD, LEFT, RIGHT, PELVIS = range(4)
_OTHER_TIME = 1_000_000_000  # added to a seed: the same person another time
CLIP_S = 8.0


@dataclass(frozen=True)
class Case:
    """One calibration of one user.

    Attributes:
        take: what was recorded.
        before, after: by the T-pose alone, and with the movement.
        found_s, done_s: when the T-pose was complete, and all of it.
        missing: what the movement did not show.
    """

    take: SimulatedTake
    before: Calibration
    after: Calibration
    found_s: float
    done_s: float
    missing: tuple[str, ...]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", nargs="*", type=Path)
    parser.add_argument("--users", type=int, default=500)
    parser.add_argument("--seed", type=int, default=5000)
    parser.add_argument(
        "--steady", action="store_true", help="wrists turn about the same axes every time"
    )
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    movements = _recorded(args.clips) if args.clips else []
    seeds = range(args.seed, args.seed + args.users)
    pairs = [tuple(_case(seed, time, movements, args.steady) for time in (0, 1)) for seed in seeds]
    text = "\n".join([_head(args), *_tables(pairs)])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _recorded(paths: Sequence[Path]) -> list[Motion]:
    """The first seconds of each clip that is long enough."""
    motions = [m for m in retarget(find_clips(paths)) if m.duration_s >= CLIP_S]
    n = round(CLIP_S * 45.0)
    return [
        replace(m, p_hips=m.p_hips[:n], R_local=m.R_local[:n], p_toes=m.p_toes[:n]) for m in motions
    ]


def _case(seed: int, time: int, movements: Sequence[Motion], steady: bool) -> Case:
    rng = np.random.default_rng([seed, 7, time])
    if movements:
        movement = movements[(2 * seed + time) % len(movements)]
    else:
        habits = Habits.drawn(np.random.default_rng([seed, 6]))
        now = Performance.drawn(rng)
        if steady:
            zero = np.zeros((2, 3))
            now = replace(now, twist_slip=zero, bend_slip=zero)
        movement = calibrating_movement(habits, rng, now)
    take = simulate(movement, seed + _OTHER_TIME * time, user=drawn_user(seed))
    detector = TPoseDetector()  # without hints: roles by geometry
    samples = list(take_samples(take))
    pose = detector.add(samples)
    if pose is None:
        raise detector.failure()
    refined = refine_by_movement(pose, movement_from_samples(samples, pose.serials, pose.end_s))
    return Case(
        take,
        calibrate_t_pose(pose),
        refined.calibration,
        pose.end_s,
        float(take.times_s[-1]),
        refined.missing,
    )


def _tables(pairs: Sequence[tuple[Case, ...]]) -> list[str]:
    first = [pair[0] for pair in pairs]
    rows = [
        "| median / 95th percentile | T-pose alone | with movement | wanted |",
        "|---|---|---|---|",
    ]
    for name, error, wanted in ROWS:
        before, after = (
            np.array([np.mean(np.asarray(error(case.take, found))) for case, found in cases])
            for cases in (
                [(case, case.before) for case in first],
                [(case, case.after) for case in first],
            )
        )
        rows.append(f"| {name} | {_two(before)} | {_two(after)} | {wanted} |")
    for i, role in enumerate(FOUR_POINTS):
        rows.append(
            f"| {role.replace('_', ' ')} between two takes, degrees | "
            f"{_two(_apart(pairs, i, 'before'))} | {_two(_apart(pairs, i, 'after'))} | "
            f"{'3' if 'hand' in role else ''} |"
        )
    return [*rows, "", *_words(first)]


def _words(cases: Sequence[Case]) -> list[str]:
    found = np.array([case.found_s for case in cases])
    done = np.array([case.done_s for case in cases])
    missing = Counter(word for case in cases for word in case.missing)
    told = ", ".join(f"{word} ({count})" for word, count in missing.most_common()) or "nothing"
    return [
        f"T-pose complete {_two(found)} s after standing ready, movement done after {_two(done)} s "
        f"(longest {np.max(done):.1f} s). Not seen in the movement, of {len(cases)}: {told}.",
        "",
    ]


def _apart(pairs: Sequence[tuple[Case, ...]], i: int, which: str) -> Array:
    R = np.array([[getattr(case, which).R_tracker_joint[i] for case in pair] for pair in pairs])
    return np.asarray(np.rad2deg(geodesic_angle(R[:, 0], R[:, 1])))


def _off(take: SimulatedTake, found: Calibration, i: int) -> Array:
    """The found joint frame in the true one."""
    return np.asarray(take.user.mounts[FOUR_POINTS[i]].R @ found.R_tracker_joint[i])


def _rotation(*joints: int) -> Callable[[SimulatedTake, Calibration], list[float]]:
    return lambda take, found: [
        float(np.rad2deg(geodesic_angle(_off(take, found, i), np.eye(3)))) for i in joints
    ]


def _tilt(i: int) -> Callable[[SimulatedTake, Calibration], float]:
    return lambda take, found: float(
        np.rad2deg(np.arccos(np.clip(_off(take, found, i)[1, 1], -1.0, 1.0)))
    )


def _yaw(i: int) -> Callable[[SimulatedTake, Calibration], float]:
    return lambda take, found: float(np.rad2deg(np.abs(heading_angle(_off(take, found, i))[0])))


def _lever(
    joints: Sequence[int], *axes: int
) -> Callable[[SimulatedTake, Calibration], list[float]]:
    """Centimetres along axes of the true joint."""

    def error(take: SimulatedTake, found: Calibration) -> list[float]:
        values = []
        for i in joints:
            mount = take.user.mounts[FOUR_POINTS[i]]
            off = mount.R @ (mount.inverse().p - found.p_tracker_joint[i])
            values.append(100.0 * float(np.linalg.norm(off[list(axes)])))
        return values

    return error


def _hips_height(take: SimulatedTake, found: Calibration) -> float:
    return abs(100.0 * float(1.0 / found.scale - 1.0 / take.user.body.scale[0]))


def _scale(take: SimulatedTake, found: Calibration) -> float:
    return abs(100.0 * float(take.user.body.scale[0] / found.scale - 1.0))


def _arm(take: SimulatedTake, found: Calibration) -> float:
    true = float(np.abs(take.user.body.offsets[0, [8, 9], 0]).sum())
    return abs(100.0 * (found.arm_m / true - 1.0))


def _facing(take: SimulatedTake, found: Calibration) -> float:
    true = heading_angle(take.user.T_tracking_play.R)[0]
    return abs(float(np.rad2deg(turn_between(found.heading_rad, true))))


ROWS: tuple[tuple[str, Callable[[SimulatedTake, Calibration], object], str], ...] = (
    ("head, degrees", _rotation(HEAD), "2"),
    ("hands, degrees (mean of both)", _rotation(LEFT, RIGHT), "6"),
    ("left hand, degrees", _rotation(LEFT), "6"),
    ("right hand, degrees", _rotation(RIGHT), "6"),
    ("pelvis, tilt, degrees", _tilt(PELVIS), "2"),
    ("pelvis, heading, degrees", _yaw(PELVIS), "3"),
    ("heading of the T-pose, degrees", _facing, ""),
    ("head lever, cm", _lever([HEAD], 0, 1, 2), "1"),
    ("wrist lever, cm (mean of both)", _lever([LEFT, RIGHT], 0, 1, 2), "1.5"),
    ("hips sideways, cm", _lever([PELVIS], 0), "1"),
    ("hips forward, cm", _lever([PELVIS], 2), "2"),
    ("hips up, cm", _lever([PELVIS], 1), ""),
    ("hips height, cm", _hips_height, "2"),
    ("height scale, %", _scale, "2"),
    ("arm length, %", _arm, ""),
)


def _two(values: Array) -> str:
    return f"{np.median(values):.2f} / {np.percentile(values, 95.0):.2f}"


def _head(args: argparse.Namespace) -> str:
    clips = " ".join(shown(path) for path in args.clips)
    flag = " --steady" if args.steady else ""
    command = (
        f"python tools/movement_table.py --users {args.users} --seed {args.seed}{flag} {clips}"
    )
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

Simulated users as under Calibration, who after their T-pose nod, twist and bend the wrists, bow,
take two or three steps and turn on the spot, each in their own way (docs/calibration.md says what
is assumed). Roles told apart by geometry.

`{command.strip()}`, {date}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
