"""Does the detector take anything else for a T-pose? Recorded motion is full of poses.

    python tools/t_pose_search.py FOLDER [FOLDER ...] [--write]

Every clip is worn by a simulated user without a T-pose before it. Captures often begin or end with
a T-pose of their own, so each find is held against the true arms: how far from straight out? Those
are T-poses of real people, sloppier than simulated ones: what they calibrate to is told as well.
"""

import argparse
import datetime
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from calibration_table import Case, measures_table, offsets_table
from results_page import write_section

from lobstr_hw.calibration import TPose, TPoseDetector, calibrate_t_pose
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, angle_between
from lobstr_hw.simulation import SimulatedTake, simulate, take_samples
from lobstr_hw.skeleton import Joint

TITLE = "## T-poses in recordings"
STRAIGHT_OUT_DEG = 30.0
USERS = 8
ARMS = ((Joint.LEFT_UPPER_ARM, Joint.LEFT_HAND), (Joint.RIGHT_UPPER_ARM, Joint.RIGHT_HAND))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    text = "\n".join([_head(args.folders), *_report(args.folders)])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _report(folders: Sequence[Path]) -> list[str]:
    rows = ["| set | pieces | minutes | finds | of these T-poses |", "|---|---|---|---|---|"]
    cases: list[Case] = []
    off_deg: list[float] = []
    for folder in folders:
        seconds, finds, true = 0.0, 0, 0
        motions = [m for m in retarget(find_clips([folder])) if m.duration_s >= 2.0]
        for i, motion in enumerate(motions):
            seconds += motion.duration_s
            take = simulate(motion, i, rate_hz=45.0, t_pose_s=0.0)
            hints = {serial: role for role, serial in take.serials.items()}
            pose = TPoseDetector(hints, every_s=0.2).add(take_samples(take))
            if pose is None:
                continue
            finds += 1
            off_deg.append(_arms_off_deg(take, pose))
            if off_deg[-1] < STRAIGHT_OUT_DEG:
                true += 1
                cases += list(_users(motion, i))
        rows.append(
            f"| {folder.parent.name if folder.name == 'clips' else folder.name} | {len(motions)} "
            f"| {seconds / 60.0:.0f} | {finds} | {true} |"
        )
    if not cases:
        return [*rows, "", "Nothing in these sets was taken for a T-pose that is one."]
    return [
        *rows,
        "",
        f"The worse arm of a find is {np.median(off_deg):.0f} degrees off straight in the median, "
        f"{np.max(off_deg):.0f} at most. What these T-poses calibrate to, each worn by {USERS} "
        f"users ({len(cases)} cases; the performers held no controllers, so the turn of their "
        "hands about the arm says little about people who do):",
        "",
        *offsets_table(cases),
        "",
        *measures_table(cases, heading=False),
    ]


def _users(motion: Motion, first: int) -> Iterator[Case]:
    """The same T-pose on other bodies, with other mounts."""
    for user in range(USERS):
        take = simulate(motion, first + 10_000 * user, rate_hz=45.0, t_pose_s=0.0)
        hints = {serial: role for role, serial in take.serials.items()}
        pose = TPoseDetector(hints, every_s=0.2).add(take_samples(take))
        if pose is not None:
            yield Case(take, pose, calibrate_t_pose(pose))


def _arms_off_deg(take: SimulatedTake, pose: TPose) -> float:
    """The farther arm's angle from straight out to its side, in the middle of a find."""
    i = int(np.searchsorted(take.truth_times_s, (pose.start_s + pose.end_s) / 2.0))
    p: Array = take.truth_p[i]
    across = p[Joint.LEFT_UPPER_ARM] - p[Joint.RIGHT_UPPER_ARM]
    sides = (across, -across)
    off = [angle_between(p[h] - p[s], out) for (s, h), out in zip(ARMS, sides, strict=True)]
    return float(np.rad2deg(np.max(off)))


def _head(folders: Sequence[Path]) -> str:
    shown = " ".join("/".join(folder.parts[-2:]) for folder in folders)
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

Every clip worn by a simulated user; captures often begin or end with a T-pose of their own. A find
counts as one when both arms are within {STRAIGHT_OUT_DEG:g} degrees of straight out.

`python tools/t_pose_search.py {shown}`, {date}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
