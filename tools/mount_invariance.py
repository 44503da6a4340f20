"""Does the body depend on how the trackers are strapped on? It must not.

    python tools/mount_invariance.py CLIP.bvh [CLIP.bvh ...] [--users 8] [--seed 1] [--write]

Each user does the same motion twice, with other mounts and another heading of the play space,
calibrates by the T-pose each time, and the two lower bodies are compared joint by joint.
"""

import argparse
import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from made_takes import calibrated, first_seconds
from results_page import write_section

from lobstr_hw.avatar import Avatar
from lobstr_hw.calibration import Calibration
from lobstr_hw.motion import Motion
from lobstr_hw.predictors import load_predictor
from lobstr_hw.predictors.predictor import Frame, Predictor
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, geodesic_angle
from lobstr_hw.simulation import (
    SimulatedTake,
    Sway,
    TrackingErrors,
    drawn_user,
    simulate,
)
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.trackers import FOUR_POINTS

TITLE = "## Mounts"
LONGEST_S = 20.0
SETTLE_S = 2.5  # the step into the motion, after the T-pose
LOWER_BODY = {
    "upper legs": (Joint.LEFT_UPPER_LEG, Joint.RIGHT_UPPER_LEG),
    "lower legs": (Joint.LEFT_LOWER_LEG, Joint.RIGHT_LOWER_LEG),
    "feet": (Joint.LEFT_FOOT, Joint.RIGHT_FOOT),
}
CASES = {
    "perfect tracking, ideal T-poses": (TrackingErrors.none(), 0.0, False),
    "perfect tracking, the same sloppy T-pose": (TrackingErrors.none(), 10.0, False),
    "Lighthouse errors, the same sloppy T-pose": (TrackingErrors(), 10.0, False),
    "Lighthouse errors, another sloppy T-pose each time": (TrackingErrors(), 10.0, True),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", nargs="+", type=Path)
    parser.add_argument("--users", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--predictor", default="lobstr")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    predictor = load_predictor(args.predictor)
    motions = [m for m in retarget(find_clips(args.clips)) if m.duration_s > 3.0]
    motions = [first_seconds(motion, LONGEST_S) for motion in motions]
    seeds = [1000 * args.seed + i for i in range(args.users)]
    text = "\n".join([_head(args, motions), *_table(predictor, motions, seeds)])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _table(predictor: Predictor, motions: Sequence[Motion], seeds: Sequence[int]) -> list[str]:
    rows = ["| median / 95th percentile, degrees | all | " + " | ".join(LOWER_BODY) + " |"]
    rows.append("|---|---|" + "---|" * len(LOWER_BODY))
    for name, (errors, deviation_deg, again) in CASES.items():
        parts = [
            apart(predictor, motion, seeds, errors, deviation_deg, new_t_pose=again)
            for motion in motions
        ]
        degrees = np.concatenate([part.reshape(-1, part.shape[-1]) for part in parts])
        groups = [degrees, *(degrees[:, _columns(joints)] for joints in LOWER_BODY.values())]
        rows.append(f"| {name} | " + " | ".join(_two(group) for group in groups) + " |")
    return rows


def apart(
    predictor: Predictor,
    motion: Motion,
    seeds: Sequence[int],
    errors: TrackingErrors,
    deviation_deg: float,
    *,
    new_t_pose: bool = False,
) -> Array:
    """Degrees (ticks, users, 6) between the legs' local rotations through two sets of mounts."""
    takes = [
        simulate(
            motion,
            seed + 500_000 * strap * new_t_pose,
            user=drawn_user(seed, mount_seed=seed + 1_000_000 * (strap + 1)),
            errors=errors,
            pose_deviation_deg=deviation_deg,
            sway=Sway() if deviation_deg else Sway.none(),
        )
        for strap in (0, 1)
        for seed in seeds
    ]
    legs = _legs(predictor, takes)
    first, second = np.split(legs, 2, axis=1)
    return np.asarray(np.rad2deg(geodesic_angle(first, second)))


def _legs(predictor: Predictor, takes: Sequence[SimulatedTake]) -> Array:
    """Local rotations (ticks, takes, 6, 3, 3) of the output skeletons, all takes in one batch."""
    calibrations = [calibrated(take) for take in takes]
    parts = [c.body for c in calibrations]
    body = Body(
        np.concatenate([b.offsets for b in parts]),
        np.concatenate([b.sole for b in parts]),
        np.concatenate([b.scale for b in parts]),
    )
    avatar = Avatar(predictor, body)
    state = avatar.start()
    frames = _frames(predictor, takes, calibrations)
    legs = []
    for frame in frames:
        state, pose = avatar.step(state, frame, (frame,))
        legs.append(pose.R_local[:, [j for joints in LOWER_BODY.values() for j in joints]])
    since = round((takes[0].t_pose_s[1] + SETTLE_S) * 45.0)
    return np.stack(legs[since:])


def _frames(
    predictor: Predictor, takes: Sequence[SimulatedTake], calibrations: Sequence[Calibration]
) -> list[Frame]:
    """One frame a grid step (every second sample), with a batch axis of takes."""
    roles = predictor.card.accepts
    order = [FOUR_POINTS.index(role) for role in roles]
    each = []
    for take, calibration in zip(takes, calibrations, strict=True):
        tracked = take.tracked[::2, order]
        poses = take.p[::2, order], take.R[::2, order]
        each.append(calibration.frame(0.0, roles, *poses, tracked, tracked))
    p = np.stack([f.p for f in each], axis=1)
    R = np.stack([f.R for f in each], axis=1)
    valid = np.stack([f.valid_p for f in each], axis=1)
    return [Frame(i / 45.0, roles, p[i], R[i], valid[i], valid[i]) for i in range(len(p))]


def _columns(joints: Sequence[Joint]) -> list[int]:
    order = [j for group in LOWER_BODY.values() for j in group]
    return [order.index(joint) for joint in joints]


def _two(values: Array) -> str:
    return f"{np.median(values):.2f} / {np.percentile(values, 95.0):.2f}"


def _head(args: argparse.Namespace, motions: Sequence[Motion]) -> str:
    clips = " ".join("/".join(path.parts[-3:]) for path in args.clips)
    command = f"python tools/mount_invariance.py --users {args.users} --seed {args.seed} {clips}"
    date = datetime.datetime.now(tz=datetime.UTC).date()
    seconds = sum(motion.duration_s for motion in motions)
    return f"""{TITLE}

The same motion by the same person through two sets of mounts and headings, each calibrated by its
own T-pose: geodesic angle between the legs' local rotations of the two output skeletons (predictor
`{args.predictor}`, after lock and IK). {args.users} users, {seconds:.0f} s of motion each.

`{command}`, {date}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
