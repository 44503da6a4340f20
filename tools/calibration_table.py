"""How well one T-pose calibrates: many simulated users with random bodies, mounts and play spaces.

    python tools/calibration_table.py --users 200 --seed 1 [CLIP.bvh or FOLDER ...] [--write]

Prints a table in Markdown; with --write it becomes the section "Calibration" of docs/results.md.
Without clips the users stand after their T-pose, which is all that a calibration looks at; with
clips the T-pose is also searched for in what comes before and after it.
"""

import argparse
import datetime
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from made_takes import first_seconds
from results_page import shown, write_section

from lobstr_hw.calibration import Calibration, TPose, TPoseDetector, calibrate_t_pose
from lobstr_hw.calibration.heading import hands_heading, turn_between
from lobstr_hw.calibration.priors import EYES_OF_STATURE, HIPS_OF_STATURE
from lobstr_hw.motion import Motion
from lobstr_hw.poses import Pose
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, geodesic_angle, heading_angle, rotation_y
from lobstr_hw.simulation import PoseDeviation, SimulatedTake, Sway, simulate, take_samples
from lobstr_hw.simulation.t_pose import t_pose_motion
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

TITLE = "## Calibration"
CLIP_S = 3.0


@dataclass(frozen=True)
class Case:
    take: SimulatedTake
    pose: TPose
    calibration: Calibration


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", nargs="*", type=Path)
    parser.add_argument("--users", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    motions = _motions(args.clips, args.seed)
    tables = [
        _section(motions, args.users, args.seed, deviation_deg) for deviation_deg in (10.0, 0.0)
    ]
    text = "\n".join([_head(args, len(motions)), *tables])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _motions(paths: Sequence[Path], seed: int) -> list[Motion]:
    if not paths:
        rng = np.random.default_rng(seed)
        return [t_pose_motion(1.0, 45.0, PoseDeviation.none(), Sway.none(), rng)]
    motions = [m for m in retarget(find_clips(paths)) if m.duration_s > 1.0]
    return [first_seconds(motion, CLIP_S) for motion in motions]


def _section(motions: Sequence[Motion], users: int, seed: int, deviation_deg: float) -> str:
    cases = list(_cases(motions, users, seed, deviation_deg))
    head = (
        f"### Every segment up to {deviation_deg:g} degrees off the T-pose"
        if deviation_deg
        else "### An ideal T-pose (what is left is the method's own)"
    )
    found = f"T-pose found, with the right roles, for {len(cases)} of {users} users."
    return "\n".join([head, "", found, "", *offsets_table(cases), "", *measures_table(cases), ""])


def _cases(
    motions: Sequence[Motion], users: int, seed: int, deviation_deg: float
) -> Iterator[Case]:
    for i in range(users):
        motion = motions[i % len(motions)]
        take = simulate(motion, seed * 100_000 + i, pose_deviation_deg=deviation_deg)
        detector = TPoseDetector()  # without hints: roles by geometry
        pose = detector.add(take_samples(take))
        if pose is None:
            print(f"user {i}: {detector.failure()}", file=sys.stderr)
        elif pose.serials != tuple(take.serials[role] for role in FOUR_POINTS):
            print(f"user {i}: roles exchanged", file=sys.stderr)
        else:
            yield Case(take, pose, calibrate_t_pose(pose))


def offsets_table(cases: Sequence[Case]) -> list[str]:
    rows = [
        "| median / 95th percentile | rotation, degrees | its tilt | its heading | position, cm |",
        "|---|---|---|---|---|",
    ]
    for i, role in enumerate(FOUR_POINTS):
        mounts = [case.take.user.mounts[role] for case in cases]
        found = [case.calibration.R_tracker_joint[i] for case in cases]
        p = [
            m.inverse().p - c.calibration.p_tracker_joint[i]
            for m, c in zip(mounts, cases, strict=True)
        ]
        if role is TrackerRole.HEAD:  # the paper's way, without the headset's prior
            straight = [c.pose.R[0].T @ rotation_y(c.calibration.heading_rad) for c in cases]
            rows.append(_row("head, taken as held straight", mounts, straight, p))
        rows.append(_row(role.replace("_", " "), mounts, found, p))
    return rows


def _row(name: str, mounts: Sequence[Pose], found: Sequence[Array], off_m: Sequence[Array]) -> str:
    R = np.stack([mount.R for mount in mounts]) @ np.stack(found)
    tilt = np.arccos(np.clip(R[:, 1, 1], -1.0, 1.0))
    values = (
        np.rad2deg(geodesic_angle(R, np.eye(3))),
        np.rad2deg(tilt),
        np.rad2deg(np.abs(heading_angle(R)[0])),
        100.0 * np.linalg.norm(off_m, axis=-1),
    )
    return "| ".join(["", name + " ", *(_two(v) + " " for v in values)]) + "|"


def measures_table(cases: Sequence[Case], *, heading: bool = True) -> list[str]:
    bodies = [case.take.user.body for case in cases]
    true_hips = np.array([1.0 / body.scale[0] for body in bodies])
    found_hips = np.array([1.0 / case.calibration.scale for case in cases])
    true_arm = np.array([np.abs(body.offsets[0, [8, 9], 0]).sum() for body in bodies])
    found_arm = np.array([case.calibration.arm_m for case in cases])
    true_stature = np.array([case.take.user.stature_m for case in cases])
    stature = np.array([case.calibration.stature_m for case in cases])
    eyes_only = np.array([HIPS_OF_STATURE * c.pose.p[0, 1] / EYES_OF_STATURE for c in cases])
    told = [calibrate_t_pose(c.pose, stature_m=c.take.user.stature_m) for c in cases]
    told_hips = np.array([1.0 / calibration.scale for calibration in told])
    yaw = np.array([heading_angle(c.take.user.T_tracking_play.R)[0] for c in cases])
    found_yaw = np.array([case.calibration.heading_rad for case in cases])
    hands_yaw = np.array([hands_heading(c.pose.p[1], c.pose.p[2]) for c in cases])
    rows = (
        ("heading, degrees", _degrees(found_yaw, yaw)),
        ("heading from the hands alone, degrees", _degrees(hands_yaw, yaw)),
        ("height scale and leg length, %", _percent(found_hips, true_hips)),
        ("the same from the headset alone, %", _percent(eyes_only, true_hips)),
        ("the same where the stature is told, %", _percent(told_hips, true_hips)),
        ("arm length, %", _percent(found_arm, true_arm)),
        ("stature, %", _percent(stature, true_stature)),
    )
    return [
        "| | median / 95th percentile |",
        "|---|---|",
        *(f"| {name} | {_two(values)} |" for name, values in rows[0 if heading else 2 :]),
    ]


def _degrees(found: Array, true: Array) -> Array:
    return np.asarray(np.rad2deg(np.abs(turn_between(found, true))))


def _percent(found: Array, true: Array) -> Array:
    return np.asarray(100.0 * np.abs(found / true - 1.0))


def _two(values: Array) -> str:
    return f"{np.median(values):.2f} / {np.percentile(values, 95.0):.2f}"


def _head(args: argparse.Namespace, motions: int) -> str:
    clips = " ".join(shown(path) for path in args.clips)
    command = f"python tools/calibration_table.py --users {args.users} --seed {args.seed} {clips}"
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

Simulated users of 150 to 195 cm, legs 2.5 % and arms and shoulders 3 % off the mean of their
stature, random mounts (hands and pelvis turned any way, belly tracker 8 to 15 cm in front, wand
some 10 cm off the wrist, headset within pitch 5, yaw 3, roll 2 degrees), any play space, Lighthouse
errors and sway; roles told apart by geometry; T-poses before {motions} motion(s). Errors of the
offsets are between the true and the found joint frame.

`{command.strip()}`, {date}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
