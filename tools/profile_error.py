"""What a profile's errors cost the legs: lower-body error with it, over that with the truth.

    python tools/profile_error.py CLIP.bvh or FOLDER ... --users 60 --seed 7000 [--write]

Each user calibrates (T-pose and movement) and then does a clip. The same trackers go to the
predictor three times: by the true offsets, by the profile after the movement, by the T-pose alone.
"""

import argparse
import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from made_takes import first_seconds
from results_page import shown, write_section

from lobstr_hw.calibration import (
    Calibration,
    TPoseDetector,
    calibrate_t_pose,
    movement_from_samples,
    refine_by_movement,
)
from lobstr_hw.evaluation.metrics import Legs, Tally, tally
from lobstr_hw.evaluation.rollout import Rollout
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.lower_body import toes_in_reference
from lobstr_hw.motion import Motion
from lobstr_hw.predictors import Frame, Predictor, load_predictor
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, heading, transpose
from lobstr_hw.simulation import (
    Habits,
    SimulatedTake,
    SimulatedUser,
    calibrating_movement,
    drawn_user,
    simulate,
    take_samples,
)
from lobstr_hw.skeleton import Body
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

TITLE = "## Profile and legs"
LONGEST_S = 20.0
SHORTEST_S = 5.0
PELVIS = FOUR_POINTS.index(TrackerRole.PELVIS)
_LATER = 2_000_000_000  # added to a seed: the clip comes some time after the calibration
ROWS = ("true offsets", "profile after the movement", "T-pose alone")


@dataclass(frozen=True)
class Wearer:
    """A user, the clip, and three calibrations in the order of ROWS."""

    take: SimulatedTake
    truth: Truth
    calibrations: tuple[Calibration, Calibration, Calibration]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", nargs="+", type=Path)
    parser.add_argument("--users", type=int, default=60)
    parser.add_argument("--seed", type=int, default=7000)
    parser.add_argument("--predictor", default="lobstr")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    predictor = load_predictor(args.predictor)
    motions = [m for m in retarget(find_clips(args.clips)) if m.duration_s >= SHORTEST_S]
    wearers = [
        _wearer(args.seed + i, first_seconds(motions[i % len(motions)], LONGEST_S))
        for i in range(args.users)
    ]
    text = "\n".join([_head(args, wearers), *_table(predictor, wearers)])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _wearer(seed: int, motion: Motion) -> Wearer:
    user = drawn_user(seed)
    habits = Habits.drawn(np.random.default_rng([seed, 6]))
    calibrating = calibrating_movement(habits, np.random.default_rng([seed, 7]))
    take = simulate(calibrating, seed, user=user)
    samples = list(take_samples(take))
    detector = TPoseDetector({serial: role for role, serial in user.serials.items()})
    pose = detector.add(samples)
    if pose is None:
        raise detector.failure()
    movement = movement_from_samples(samples, pose.serials, pose.end_s)
    refined = refine_by_movement(pose, movement).calibration
    later = simulate(motion, seed + _LATER, rate_hz=motion.rate_hz, user=user, t_pose_s=0.0)
    return Wearer(
        later, Truth.of(motion), (true_calibration(user), refined, calibrate_t_pose(pose))
    )


def true_calibration(user: SimulatedUser) -> Calibration:
    """The one that nobody knows."""
    inverse = [user.mounts[role].inverse() for role in FOUR_POINTS]
    return Calibration(
        {user.serials[role]: role for role in FOUR_POINTS},
        np.stack([T.R for T in inverse]),
        np.stack([T.p for T in inverse]),
        user.body,
        user.stature_m,
    )


def _table(predictor: Predictor, wearers: Sequence[Wearer]) -> list[str]:
    rows = [
        "| | position error, cm | over the truth's | its own heading, cm | over the truth's "
        "| rotation error, degrees | balanced contact accuracy |",
        "|---|---|---|---|---|---|---|",
    ]
    best: list[float] = []
    for k, name in enumerate(ROWS):
        said, R_ref = _rolled_out(predictor, wearers, k)
        given = _scores(wearers, said, [w.truth.R_ref for w in wearers])
        own = _scores(wearers, said, R_ref)
        errors = [float(s["position_error_cm"] or 0.0) for s in (given, own)]
        best = best or errors
        more = [f"{100.0 * (e / b - 1.0):+.1f} %" for e, b in zip(errors, best, strict=True)]
        rows.append(
            f"| {name} | {errors[0]:.2f} | {more[0]} | {errors[1]:.2f} | {more[1]} "
            f"| {given['rotation_error_deg']:.2f} | {given['contact_balanced_accuracy']:.3f} |"
        )
    return rows


def _scores(wearers, said, R_ref):  # type: ignore[no-untyped-def]
    """Scores of all, the legs put under these reference frames at the true hips."""
    total = Tally()
    for wearer, rollout, ref in zip(wearers, said, R_ref, strict=True):
        joints = rollout.joints
        toes = (ref[:, None] @ toes_in_reference(joints)[..., None])[..., 0]
        p_toes = wearer.truth.p_hips[:, None] + toes
        total += tally(wearer.truth, Legs(joints, p_toes, rollout.contact > 0.5))
    return total.scores()


def _rolled_out(
    predictor: Predictor, wearers: Sequence[Wearer], which: int
) -> tuple[list[Rollout], list[Array]]:
    """What the predictor says to each, and the reference frames it was given, in the play space."""
    frames = [_frame(wearer, which) for wearer in wearers]
    longest = max(len(frame.p) for frame in frames)
    state = predictor.start(Body.standard(len(wearers)))
    said = []
    for i in range(longest):
        at = [min(i, len(frame.p) - 1) for frame in frames]
        p, R, valid_p, valid_R = (
            np.stack([getattr(f, field)[k] for f, k in zip(frames, at, strict=True)])
            for field in ("p", "R", "valid_p", "valid_R")
        )
        state, prediction = predictor.step(
            state, Frame(i / 45.0, FOUR_POINTS, p, R, valid_p, valid_R)
        )
        said.append(prediction)
    rollouts, references = [], []
    for k, (wearer, frame) in enumerate(zip(wearers, frames, strict=True)):
        own = said[: len(wearer.truth)]
        rollouts.append(
            Rollout(
                np.stack([s.R[k] for s in own]),
                np.stack([s.C[k] for s in own if s.C is not None]),
                np.stack([s.contact[k] for s in own]),
            )
        )
        play = transpose(wearer.take.user.T_tracking_play.R)
        references.append(play @ heading(frame.R[:, PELVIS]))
    return rollouts, references


def _frame(wearer: Wearer, which: int) -> Frame:
    """All frames of a clip at once."""
    take = wearer.take
    n = len(wearer.truth)
    order = [list(wearer.calibrations[which].roles.values()).index(role) for role in FOUR_POINTS]
    assert order == [0, 1, 2, 3]
    p, R, tracked = take.p[:n], take.R[:n], take.tracked[:n]
    return wearer.calibrations[which].frame(0.0, FOUR_POINTS, p, R, tracked, tracked)


def _head(args: argparse.Namespace, wearers: Sequence[Wearer]) -> str:
    clips = " ".join(shown(path) for path in args.clips)
    command = f"python tools/profile_error.py {clips} --users {args.users} --seed {args.seed}"
    date = datetime.datetime.now(tz=datetime.UTC).date()
    seconds = sum(len(w.truth) / w.truth.rate_hz for w in wearers)
    return f"""{TITLE}

Lower-body error of the predictor `{args.predictor}` (carried, before lock and IK) with trackers put
right by three calibrations of the same user: {args.users} simulated users, {seconds:.0f} s in all,
Lighthouse errors. Position error as everywhere: of the toe bases on the 1.0 m skeleton, the true
root and heading given; "its own heading": under the heading that the calibrated pelvis has.

`{command}`, {date}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
