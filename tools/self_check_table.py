"""Does the self-check notice what goes wrong? Wrong and good calibrations of many simulated users.

    python tools/self_check_table.py --users 500 --seed 6000 [--write]

Each case goes the wizard's way: a T-pose is looked for, then refined by movement, then checked. It
is rejected when no T-pose is found or the self-check says no; either way with a reason.
"""

import argparse
import datetime
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from results_page import write_section

from lobstr_hw.calibration import (
    TPoseDetector,
    check_calibration,
    check_start,
    movement_from_samples,
    refine_by_movement,
)
from lobstr_hw.motion import Motion
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import from_rotation_vector
from lobstr_hw.simulation import (
    Habits,
    PoseDeviation,
    SimulatedTake,
    SimulatedUser,
    Sway,
    calibrating_movement,
    drawn_user,
    simulate,
    take_samples,
)
from lobstr_hw.simulation.mishaps import any_direction, arms_off_level, seated, slipped, unseen
from lobstr_hw.simulation.t_pose import t_pose_motion
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

TITLE = "## Self-check"
RATE_HZ = 45.0
T_POSE_S = 3.0
LOOKED_AT_S = 0.6  # the recording begins before the wizard starts to look
GESTURES_S = 2.6  # of the movement, that can be done on a chair
WINDOW_S = (0.65, 2.1)  # where an undisturbed T-pose is taken


@dataclass(frozen=True)
class Outcome:
    rejected: bool
    stage: str
    reason: str


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--users", type=int, default=500)
    parser.add_argument("--seed", type=int, default=6000)
    parser.add_argument("--only", help="kinds with this in their name")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    text = "\n".join([_head(args), *_table(args.users, args.seed, args.only or "")])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _table(users: int, seed: int, only: str) -> list[str]:
    rows = [
        "| | rejected | of | share, 95 % interval | noticed by | most frequent reasons |",
        "|---|---|---|---|---|---|",
    ]
    for name, case in KINDS.items():
        if only in name:
            rows.append(_row(name, [case(seed + i) for i in range(users)]))
            print(rows[-1], flush=True)
    return rows


def _row(name: str, outcomes: list[Outcome]) -> str:
    n, k = len(outcomes), sum(o.rejected for o in outcomes)
    low, high = wilson(k, n)
    share = f"{100.0 * k / n:.1f} % ({100.0 * low:.1f} to {100.0 * high:.1f})"
    stages = Counter(o.stage for o in outcomes if o.rejected)
    by = ", ".join(f"{stage} {count}" for stage, count in stages.most_common())
    reasons = Counter(o.reason for o in outcomes if o.rejected)
    why = ", ".join(f"{reason} {count}" for reason, count in reasons.most_common(4))
    return f"| {name} | {k} | {n} | {share} | {by} | {why} |"


def wilson(k: int, n: int) -> tuple[float, float]:
    """The 95 % interval of a share."""
    z = 1.96
    middle = (k + z**2 / 2.0) / (n + z**2)
    half = z / (n + z**2) * np.sqrt(k * (n - k) / n + z**2 / 4.0)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def outcome(take: SimulatedTake, hints: dict[str, TrackerRole] | None = None) -> Outcome:
    """What becomes of a take."""
    own = {serial: role for role, serial in take.serials.items()}
    detector = TPoseDetector(own if hints is None else hints)
    samples = list(take_samples(take))
    end_s = take.t_pose_s[1] + 0.1
    pose = detector.add(s for s in samples if LOOKED_AT_S <= s.time_s <= end_s)
    if pose is None:
        failed = detector.best.failed if detector.best else ()
        return Outcome(True, "T-pose", failed[0].name if failed else "not in sight")
    recording = movement_from_samples(samples, pose.serials)
    result = refine_by_movement(pose, recording.between(pose.end_s))
    check = check_calibration(pose, recording, result)
    first = check.failed[0].name if check.failed else ""
    return Outcome(not check.ok, "self-check", first.removeprefix("left_").removeprefix("right_"))


def _rng(seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, 11])


def _movement(seed: int) -> Motion:
    habits = Habits.drawn(np.random.default_rng([seed, 6]))
    return calibrating_movement(habits, np.random.default_rng([seed, 7]))


def _good_take(seed: int) -> SimulatedTake:
    return simulate(_movement(seed), seed)


def good(seed: int) -> Outcome:
    return outcome(_good_take(seed))


def exchanged(seed: int) -> Outcome:
    """Any wrong order of the four roles."""
    take = _good_take(seed)
    wrong = list(permutations(FOUR_POINTS))[1:]
    order = wrong[int(_rng(seed).integers(len(wrong)))]
    serials = [take.serials[role] for role in FOUR_POINTS]
    return outcome(take, dict(zip(serials, order, strict=True)))


def _t_pose(seed: int, change: Callable[[PoseDeviation], PoseDeviation] = lambda d: d) -> Motion:
    rng = np.random.default_rng([seed, 4])
    deviation = change(PoseDeviation.drawn(rng, np.deg2rad(10.0)))
    return t_pose_motion(T_POSE_S, RATE_HZ, deviation, Sway(), rng)


def sitting(seed: int) -> Outcome:
    """On a chair or stool; every second one gets up for the movement."""
    rng = _rng(seed)
    hips = rng.uniform(0.50, 0.68)  # of the standing height
    t_pose = seated(_t_pose(seed), hips)
    movement = _movement(seed)
    if seed % 2:
        n = round(GESTURES_S * RATE_HZ)
        part = Motion(
            "gestures",
            "simulated",
            RATE_HZ,
            movement.p_hips[:n],
            movement.R_local[:n],
            movement.p_toes[:n],
            1.0,
        )
        movement = seated(part, hips)
    return outcome(simulate(movement, seed, t_pose=t_pose))


def arms(seed: int) -> Outcome:
    """One arm or both, up or down, 30 to 60 degrees from level."""
    rng = _rng(seed)
    up = np.deg2rad(rng.uniform(30.0, 60.0, 2)) * rng.choice([-1.0, 1.0], 2)
    which = int(rng.integers(3))
    left, right = (up[0] if which != 1 else 0.0), (up[1] if which != 0 else 0.0)

    def change(deviation: PoseDeviation) -> PoseDeviation:
        # from level: what an arm is off anyway does not help it back
        straight = np.where([[left != 0.0], [right != 0.0]], 0.0, deviation.arms)
        own = PoseDeviation(
            deviation.head, deviation.pelvis, deviation.hands, straight, deviation.trunk
        )
        return arms_off_level(own, (left, right))

    return outcome(simulate(_movement(seed), seed, t_pose=_t_pose(seed, change)))


def shifted(seed: int) -> Outcome:
    rng = _rng(seed)
    tracker, when = int(rng.integers(4)), rng.uniform(*WINDOW_S)
    shift = any_direction(rng, 0.03)
    take = slipped(_good_take(seed), tracker, when, shift=shift, lasts_s=rng.uniform(0.05, 0.3))
    return outcome(take)


def twisted(seed: int) -> Outcome:
    rng = _rng(seed)
    tracker, when = int(rng.integers(4)), rng.uniform(*WINDOW_S)
    turn = any_direction(rng, np.deg2rad(10.0))
    take = slipped(_good_take(seed), tracker, when, turn=turn, lasts_s=rng.uniform(0.05, 0.3))
    return outcome(take)


def lost(seed: int) -> Outcome:
    return outcome(unseen(_good_take(seed), int(_rng(seed).integers(4))))


def at_start(change: Callable[[SimulatedUser, int], SimulatedUser]) -> Callable[[int], Outcome]:
    """The one-second check, some time after the calibration, with something changed since."""

    def case(seed: int) -> Outcome:
        take = _good_take(seed)
        samples = list(take_samples(take))
        own = {serial: role for role, serial in take.serials.items()}
        pose = TPoseDetector(own).add(samples)
        if pose is None:
            return Outcome(True, "T-pose", "not found")
        movement = movement_from_samples(samples, pose.serials, pose.end_s)
        profile = refine_by_movement(pose, movement).calibration
        rng = np.random.default_rng([seed, 12])
        hanging = np.deg2rad(rng.normal(-72.0, 5.0, 2))
        deviation = arms_off_level(
            PoseDeviation.drawn(rng, np.deg2rad(7.0)), (float(hanging[0]), float(hanging[1]))
        )
        standing = t_pose_motion(1.2, RATE_HZ, deviation, Sway(), rng)
        later = simulate(standing, seed + 77_000_000, user=change(take.user, seed), t_pose_s=0.0)
        second = movement_from_samples(
            take_samples(later), [take.serials[role] for role in FOUR_POINTS]
        )
        check = check_start(profile, second)
        stage = "start check" if check.standing else "not standing"
        return Outcome(not check.ok, stage, check.failed[0].name if check.failed else "")

    return case


def _same(user: SimulatedUser, seed: int) -> SimulatedUser:
    return user


def _lower(user: SimulatedUser, seed: int) -> SimulatedUser:
    return _strapped(user, np.array([0.0, -0.05, 0.0]), np.zeros(3))


def _round_the_belt(user: SimulatedUser, seed: int) -> SimulatedUser:
    return _strapped(user, np.array([0.06, 0.0, -0.02]), np.array([0.0, 0.5, 0.0]))


def _turned(user: SimulatedUser, seed: int) -> SimulatedUser:
    return _strapped(user, np.zeros(3), any_direction(_rng(seed), np.deg2rad(20.0)))


def _strapped(user: SimulatedUser, shift: np.ndarray, turn: np.ndarray) -> SimulatedUser:
    """The pelvis tracker elsewhere on the pelvis."""
    T = user.mounts[TrackerRole.PELVIS]
    moved = Pose(from_rotation_vector(turn) @ T.R, T.p + shift)
    return replace(user, mounts={**user.mounts, TrackerRole.PELVIS: moved})


def _hands_exchanged(user: SimulatedUser, seed: int) -> SimulatedUser:
    left, right = TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND
    return replace(
        user, serials={**user.serials, left: user.serials[right], right: user.serials[left]}
    )


def _somebody_else(user: SimulatedUser, seed: int) -> SimulatedUser:
    other = drawn_user(seed + 1)
    return replace(user, body=other.body, stature_m=other.stature_m)


KINDS: dict[str, Callable[[int], Outcome]] = {
    "good": good,
    "roles exchanged": exchanged,
    "sitting": sitting,
    "arms 30 to 60 degrees from level": arms,
    "a tracker moved by 3 cm in the pose": shifted,
    "a tracker turned by 10 degrees in the pose": twisted,
    "one tracker not tracked": lost,
    "start check, nothing changed": at_start(_same),
    "start check, pelvis tracker 5 cm lower": at_start(_lower),
    "start check, pelvis tracker 6 cm round the belt": at_start(_round_the_belt),
    "start check, pelvis tracker turned by 20 degrees": at_start(_turned),
    "start check, hands exchanged": at_start(_hands_exchanged),
    "start check, another person": at_start(_somebody_else),
}


def _head(args: argparse.Namespace) -> str:
    command = f"python tools/self_check_table.py --users {args.users} --seed {args.seed}"
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

Simulated users as under Calibration. A case is rejected when no T-pose is accepted, or when the
self-check after the movement says no; the reason that is counted is the worst check. Start check:
one second of standing with hanging arms, some time later; rejected means that it warns. Intervals
are Wilson's.

`{command}`, {date}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
