"""Is the network as good for small and tall people, any mounts, any rate, and in the 30th minute?

    python tools/robustness_table.py CLIP.bvh or FOLDER ... [--users 16] [--seed 9000] [--write]

Simulated users wear trackers, calibrate by a sloppy T-pose and do clips; the legs are scored.
"""

import argparse
import datetime
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from made_takes import calibrated, first_seconds
from results_page import shown, write_section
from session_error import SETTLE_S, session_error

from lobstr_hw.evaluation.rollout import Rollout
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import toes_in_reference, true_lower_body
from lobstr_hw.motion import Motion
from lobstr_hw.predictors import Frame, Predictor, load_predictor
from lobstr_hw.predictors.lobstr import GIVES
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array
from lobstr_hw.simulation import SimulatedTake, drawn_user, joined, simulate
from lobstr_hw.skeleton import STATURE, Body, Joint, local_rotations
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

TITLE = "## Steadiness"
LONGEST_S = 20.0
SHORTEST_S = 8.0
GRID_HZ = 45.0
STATURES_CM = (150, 160, 170, 180, 195)
RATES_HZ = (45, 60, 72, 90, 120)
MINUTES = 30
PELVIS = FOUR_POINTS.index(TrackerRole.PELVIS)


@dataclass(frozen=True)
class Worn:
    """Trackers put right: joints on the standard skeleton at 45 Hz, and the legs' truth.

    Attributes:
        p, R, valid: (frames, 4, ...) in the order of FOUR_POINTS.
        toes: (frames, 2, 3) true toe bases in the reference frame.
        since: first frame that counts.
    """

    p: Array
    R: Array
    valid: Bools
    toes: Array
    since: int


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clips", nargs="+", type=Path)
    parser.add_argument("--users", type=int, default=16)
    parser.add_argument("--seed", type=int, default=9000)
    parser.add_argument("--predictor", default="lobstr")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    predictor = load_predictor(args.predictor)
    motions = [m for m in retarget(find_clips(args.clips)) if m.duration_s >= SHORTEST_S]
    chosen = [motions[i * len(motions) // args.users] for i in range(args.users)]
    short = [first_seconds(motion, LONGEST_S) for motion in chosen]
    parts = [
        _statures(predictor, short, args.seed),
        _mounts(predictor, short, args.seed),
        _rates(args.predictor, short[:: max(len(short) // 4, 1)], args.seed),
        _recovery(predictor, short, args.seed),
        _drift(predictor, motions, args.seed),
    ]
    text = "\n".join([_head(args), *parts])
    print(text)
    if args.write:
        write_section(text)
    return 0


# statures and mounts


def _statures(predictor: Predictor, motions: Sequence[Motion], seed: int) -> str:
    _say("statures")
    rows = ["### Stature\n", "| toes, cm | " + " | ".join(f"{h} cm" for h in STATURES_CM) + " |"]
    rows[1] += " largest / mean | smallest / mean |"
    rows.append("|---" * (len(STATURES_CM) + 3) + "|")
    for name, own in (("scaled copies of one body", False), ("their own proportions", True)):
        errors = [
            _mean_error(predictor, _of_stature(motions, seed, stature_cm, own))
            for stature_cm in STATURES_CM
        ]
        rows.append(f"| {name} | {_with_extremes(errors)}")
    return "\n".join(rows) + "\n"


def _of_stature(motions: Sequence[Motion], seed: int, stature_cm: float, own: bool) -> list[Worn]:
    copy = Body.standard(1, stature_cm / 100.0 / STATURE)
    users = [
        drawn_user(seed + i, stature_cm, body=None if own else copy) for i in range(len(motions))
    ]
    return [_worn(simulate(m, seed + i, user=users[i])) for i, m in enumerate(motions)]


def _mounts(predictor: Predictor, motions: Sequence[Motion], seed: int) -> str:
    _say("mounts")
    straps = range(5)
    errors = []
    for strap in straps:
        takes = [
            simulate(m, seed + i, user=drawn_user(seed + i, mount_seed=seed + 1000 * (strap + 1)))
            for i, m in enumerate(motions)
        ]
        errors.append(_mean_error(predictor, [_worn(take) for take in takes]))
    head = "| toes, cm | " + " | ".join(f"strapped on {k + 1}" for k in straps)
    rows = [
        "### Mounts and headings\n",
        head + " | largest / mean | smallest / mean |",
        "|---" * (len(straps) + 3) + "|",
        f"| the same people, T-poses and clips | {_with_extremes(errors)}",
    ]
    return "\n".join(rows) + "\n"


def _with_extremes(errors: Sequence[float]) -> str:
    mean = float(np.mean(errors))
    cells = [f"{e:.2f}" for e in errors]
    return (
        f"{' | '.join(cells)} | {100.0 * (max(errors) / mean - 1.0):+.1f} % "
        f"| {100.0 * (min(errors) / mean - 1.0):+.1f} % |"
    )


def _mean_error(predictor: Predictor, worn: Sequence[Worn]) -> float:
    return _mean_of(_errors(predictor, worn), worn)


def _mean_of(errors: Sequence[Array], worn: Sequence[Worn]) -> float:
    return float(np.concatenate([e[w.since :] for e, w in zip(errors, worn, strict=True)]).mean())


def _worn(take: SimulatedTake) -> Worn:
    calibration = calibrated(take)
    step = round((1.0 / GRID_HZ) / (take.times_s[1] - take.times_s[0]))
    p, R, tracked = take.p[::step], take.R[::step], take.tracked[::step]
    frame = calibration.frame(0.0, FOUR_POINTS, p, R, tracked, tracked)
    since = round((take.t_pose_s[1] + SETTLE_S) * GRID_HZ)
    toes = _toes_of_truth(take)
    n = min(len(p), len(toes))
    return Worn(frame.p[:n], frame.R[:n], frame.valid_p[:n], toes[:n], since)


def _toes_of_truth(take: SimulatedTake) -> Array:
    """True toe bases in the reference frame on the standard skeleton (frames, 2, 3)."""
    R_local = local_rotations(take.truth_R)
    return toes_in_reference(
        true_lower_body(R_local, reference_frames(take.truth_R[:, Joint.HIPS]))
    )


def _errors(predictor: Predictor, worn: Sequence[Worn]) -> list[Array]:
    """Toe errors (frames,) of each, centimetres, the mean of both feet; all in one batch."""
    state = predictor.start(Body.standard(len(worn)))
    said: list[Array] = []
    for i in range(max(len(w.p) for w in worn)):
        at = [min(i, len(w.p) - 1) for w in worn]
        p, R, valid = (
            np.stack([getattr(w, name)[k] for w, k in zip(worn, at, strict=True)])
            for name in ("p", "R", "valid")
        )
        frame = Frame(i / GRID_HZ, FOUR_POINTS, p, R, valid, valid)
        state, prediction = predictor.step(state, frame)
        assert prediction.C is not None and predictor.card.gives == GIVES
        legs = Rollout(prediction.R, prediction.C, prediction.contact)
        said.append(toes_in_reference(legs.joints))
    toes = np.stack(said, axis=1)  # (n, frames, 2, 3)
    return [
        100.0 * np.linalg.norm(toes[k, : len(w.p)] - w.toes, axis=-1).mean(-1)
        for k, w in enumerate(worn)
    ]


# rates, through the whole program


def _rates(predictor: str, motions: Sequence[Motion], seed: int) -> str:
    rows = [
        "### Rates\n",
        "| toe bases of the shown body, hips laid over each other, cm | "
        + " | ".join(f"{r} Hz" for r in RATES_HZ)
        + " | largest / mean | smallest / mean |",
        "|---" * (len(RATES_HZ) + 3) + "|",
    ]
    for name, tracker_hz in (("trackers and loop", None), ("loop, trackers at 90 Hz", 90)):
        errors = []
        for rate in RATES_HZ:
            _say(f"{name}: {rate} Hz")
            each = [
                session_error(predictor, m, seed + i, tracker_hz or rate, rate)
                for i, m in enumerate(motions)
            ]
            errors.append(float(np.concatenate(each).mean()))
        rows.append(f"| {name} | {_with_extremes(errors)}")
    return "\n".join(rows) + "\n"


# a lost pelvis, and half an hour


def _recovery(predictor: Predictor, motions: Sequence[Motion], seed: int) -> str:
    _say("a lost pelvis")
    worn = [_worn(simulate(m, seed + i)) for i, m in enumerate(motions)]
    lost = [_without_pelvis(w, every_s=4.0) for w in worn]
    good, bad = _errors(predictor, worn), _errors(predictor, lost)
    base = _mean_of(good, worn)
    after: dict[int, list[float]] = {}
    during: list[float] = []
    for w, u, v, cut in zip(worn, good, bad, lost, strict=True):
        for start in _returns(w, cut):
            during.append(float((v - u)[start - round(GRID_HZ) : start].mean()))
            for k, excess in enumerate((v - u)[start : start + round(1.5 * GRID_HZ)]):
                after.setdefault(k, []).append(float(excess))
    mean = {k: float(np.mean(v)) for k, v in after.items()}
    back = next((k for k in mean if all(mean[j] <= 0.1 * base for j in mean if j >= k)), None)
    rows = [
        "### A pelvis tracker lost for a second\n",
        f"{len(after[0])} losses; the state is kept, and mended when it is back. Error without: "
        f"{base:.2f} cm.\n",
        "| after it is back, s | while lost | 0 | 0.1 | 0.2 | 0.3 | 0.5 | 1.0 | within 10 % from |",
        "|---|---|---|---|---|---|---|---|---|",
        f"| more error than without the loss, cm | {np.mean(during):+.2f} | "
        + " | ".join(f"{mean[round(s * GRID_HZ)]:+.2f}" for s in (0, 0.1, 0.2, 0.3, 0.5, 1.0))
        + (f" | {back / GRID_HZ:.2f} s |" if back is not None else " | later than 1.5 s |"),
    ]
    return "\n".join(rows) + "\n"


def _without_pelvis(worn: Worn, every_s: float) -> Worn:
    """The same with the pelvis lost for one second in every so many."""
    p, R, valid = np.array(worn.p), np.array(worn.R), np.array(worn.valid)
    second, period = round(GRID_HZ), round(every_s * GRID_HZ)
    for start in range(worn.since + second, len(p) - 2 * second, period):
        gone = slice(start, start + second)
        p[gone, PELVIS], R[gone, PELVIS] = p[start - 1, PELVIS], R[start - 1, PELVIS]
        valid[gone, PELVIS] = False
    return replace(worn, p=p, R=R, valid=valid)


def _returns(worn: Worn, lost: Worn) -> Iterator[int]:
    """Frames in which the pelvis is back."""
    gone = worn.valid[:, PELVIS] & ~lost.valid[:, PELVIS]
    return (int(i) for i in np.flatnonzero(gone[:-1] & ~gone[1:]) + 1)


def _drift(predictor: Predictor, motions: Sequence[Motion], seed: int) -> str:
    """One minute of motion, done 30 times by someone who never takes the trackers off."""
    per_minute: list[Array] = []
    for k in range(2):
        _say(f"half an hour: {k + 1} of 2")
        minute = joined(_a_minute(motions[k::2]))
        whole = joined([minute] * MINUTES)
        truth = Truth.of(whole)
        valid = np.ones(truth.p.shape[:2], dtype=bool)
        worn = Worn(truth.p, truth.R, valid, toes_in_reference(truth.joints), 0)
        error = _errors(predictor, [worn])[0]
        per_minute.append(np.array([part.mean() for part in np.array_split(error, MINUTES)]))
    mean = np.mean(per_minute, axis=0)
    shown_at = (1, 2, 5, 10, 20, 30)
    rows = [
        "### Half an hour of carried state\n",
        "| minute of the same movements | " + " | ".join(map(str, shown_at)) + " |",
        "|---" * (len(shown_at) + 1) + "|",
        "| toes, cm | " + " | ".join(f"{mean[m - 1]:.2f}" for m in shown_at) + " |",
    ]
    return "\n".join(rows) + "\n"


def _a_minute(motions: Sequence[Motion]) -> list[Motion]:
    out: list[Motion] = []
    for motion in (first_seconds(m, LONGEST_S) for m in motions):
        if sum(m.duration_s for m in out) < 56.0:
            out.append(motion)
    return out


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _head(args: argparse.Namespace) -> str:
    clips = " ".join(shown(path) for path in args.clips)
    command = f"python tools/robustness_table.py {clips} --users {args.users} --seed {args.seed}"
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

`{command}`, {date}: predictor `{args.predictor}`,
carried, {args.users} simulated users who calibrate by a T-pose with every segment up to 10 degrees
off, then do up to {LONGEST_S:.0f} s of a clip each, Lighthouse errors (none in the rates' rows).
Toe bases on the 1.0 m skeleton, each in its own heading; where nothing else is said before lock
and IK. Largest and smallest against the mean of the row.
"""


if __name__ == "__main__":
    raise SystemExit(main())
