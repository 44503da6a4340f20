"""Errors by what people do, the first step's delay, and people of another studio.

    python tools/activity_table.py DATA [--predictor lobstr] [--against lobstr-paper]
        [--other-studio FOLDER ...] [--write]

DATA is the folder with one folder per set. Every frame of the parts `test` and `test_same_actor`
falls into one row of each table; none is hidden in a mean.
"""

import argparse
import datetime
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from results_page import write_section
from split_clips import part_motions

from lobstr_hw.evaluation.activities import Activity, activities
from lobstr_hw.evaluation.after_ik import Shown, show
from lobstr_hw.evaluation.metrics import network_legs
from lobstr_hw.evaluation.rollout import Rollout, roll_out
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.motion import Motion
from lobstr_hw.predictors import Predictor, load_predictor
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.retargeting import find_clips, retarget
from lobstr_hw.rotations import Array, geodesic_angle

TITLE = "## What people do"
PARTS = {"test": "People nobody trained on", "test_same_actor": "Held-out clips of known people"}
RATE_HZ = 45.0
NOT_SCORED = round(RATE_HZ)
STILL_M_S, STEP_M_S = 0.05, 0.3
STILL_S, BEFORE_S, AFTER_S = 0.5, 0.3, 0.6


@dataclass(frozen=True)
class Clip:
    """A clip, its person, and the activity of each frame."""

    truth: Truth
    person: str
    activity: npt.NDArray[np.str_]


@dataclass(frozen=True)
class Errors:
    """Of many frames in a row, clip after clip; the first second of each clip left out.

    Attributes:
        toes_cm, shown_cm: (frames,) mean of both feet, of the network and after lock and IK.
        legs_deg: (frames,) legs-only rotation error of the network.
        right_on, right_off: (frames, 2) right in contact, right off the floor.
        speed_cm_s: (frames,) velocity error of the network.
        skate_cm_s: (frames, 2) after IK; only where the truth is in contact.
        delays_ms: how much later each first step is shown than it was made.
    """

    toes_cm: Array
    shown_cm: Array
    legs_deg: Array
    right_on: Bools
    right_off: Bools
    speed_cm_s: Array
    skate_cm_s: Array
    delays_ms: Array


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--predictor", default="lobstr")
    parser.add_argument("--against", default="lobstr-paper")
    parser.add_argument("--other-studio", nargs="*", type=Path, default=[])
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    text = "\n".join([_head(args), *_sections(args)])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _sections(args: argparse.Namespace) -> Iterator[str]:
    predictors = [load_predictor(args.predictor), load_predictor(args.against)]
    means, delays = {}, {}
    for part, title in PARTS.items():
        clips = _clips(part_motions(args.data, part))
        errors = [_errors(p, clips) for p in predictors]
        yield f"### {title}, by activity (`{part}`)\n\n{_table(clips, *errors)}\n"
        means[title] = [float(e.toes_cm.mean()) for e in errors]
        delays[title] = [e.delays_ms for e in errors]
    yield f"### The first step after standing still\n\n{_delay_table(args, delays)}\n"
    if args.other_studio:
        clips = _clips(retarget(find_clips(args.other_studio)))
        means["Another studio"] = [float(_errors(p, clips).toes_cm.mean()) for p in predictors]
        yield f"### Another studio\n\n{_studio_table(args, clips, means)}\n"


def _clips(motions: Iterable[Motion]) -> list[Clip]:
    out = []
    for motion in motions:
        truth = Truth.of(motion)
        if len(truth) > NOT_SCORED + 2:
            out.append(Clip(truth, motion.subject, activities(truth)))
    return out


def _errors(predictor: Predictor, clips: Sequence[Clip]) -> Errors:
    print(f"{predictor.card.name}: {len(clips)} clips", file=sys.stderr, flush=True)
    truths = [clip.truth for clip in clips]
    said = roll_out(predictor, truths, "carried")
    after = show(predictor.card, truths, said)
    each = [_of_clip(*pair) for pair in zip(truths, said, after, strict=True)]
    names = Errors.__dataclass_fields__
    return Errors(**{name: np.concatenate([getattr(e, name) for e in each]) for name in names})


def _of_clip(truth: Truth, said: Rollout, after: Shown) -> Errors:
    network = network_legs(truth, said.joints, said.contact)
    right = network.contact == truth.contact
    speed = np.linalg.norm(_velocity(network.p_toes) - _velocity(truth.p_toes), axis=-1)
    skate = np.linalg.norm(_velocity(after.p_toes)[..., [0, 2]], axis=-1)
    angle = geodesic_angle(network.joints, truth.joints)[..., 1:]
    rows = {
        "toes_cm": 100.0 * np.linalg.norm(network.p_toes - truth.p_toes, axis=-1).mean(1),
        "shown_cm": 100.0 * np.linalg.norm(after.p_toes - truth.p_toes, axis=-1).mean(1),
        "legs_deg": np.rad2deg(angle).mean((1, 2)),
        "right_on": np.where(truth.contact, right, False),
        "right_off": np.where(truth.contact, False, right),
        "speed_cm_s": 100.0 * speed.mean(1),
        "skate_cm_s": np.where(truth.contact, 100.0 * skate, np.nan),
    }
    scored = {name: values[NOT_SCORED:] for name, values in rows.items()}
    return Errors(**scored, delays_ms=first_step_delays(truth.p_toes, after.p_toes))


def _velocity(p: Array) -> Array:
    return np.diff(p, axis=0, prepend=p[:1]) * RATE_HZ


def first_step_delays(true_toes: Array, shown_toes: Array) -> Array:
    """Milliseconds from a foot's first step to when it is shown, of every stand and step.

    A step is the first moment at which a foot goes 0.3 m/s, after half a second in which both feet
    kept under 0.05 m/s. It is shown when the same foot is seen to go as fast, from 0.3 s before to
    0.6 s after; a step that is not seen counts as 0.6 s.
    """
    true_speed = np.linalg.norm(_velocity(true_toes), axis=-1)
    seen_speed = np.linalg.norm(_velocity(shown_toes), axis=-1)
    still = round(STILL_S * RATE_HZ)
    out = []
    armed = False
    quiet = 0
    for i, speeds in enumerate(true_speed):
        quiet = quiet + 1 if speeds.max() < STILL_M_S else 0
        armed = armed or quiet >= still
        if armed and speeds.max() > STEP_M_S:
            armed = False
            foot = int(speeds.argmax())
            first = i - round(BEFORE_S * RATE_HZ)
            window = seen_speed[max(first, 0) : i + round(AFTER_S * RATE_HZ) + 1, foot]
            at = np.flatnonzero(window > STEP_M_S)
            late = (max(first, 0) + at[0] - i) / RATE_HZ if len(at) else AFTER_S
            out.append(1e3 * late)
    return np.array(out)


def _table(clips: Sequence[Clip], new: Errors, old: Errors) -> str:
    labels = np.concatenate([clip.activity[NOT_SCORED:] for clip in clips])
    people = np.concatenate(
        [np.repeat(clip.person, len(clip.truth) - NOT_SCORED) for clip in clips]
    )
    rows = [
        "| | minutes | people | toes cm | of the paper's recipe | legs ° | of the paper's "
        "| balanced % | velocity cm/s | of the paper's | toes after IK cm | skate after IK cm/s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name in (*map(str, Activity), "all"):
        inside = np.ones(len(labels), dtype=bool) if name == "all" else labels == name
        if inside.any():
            who = len(np.unique(people[inside]))
            minutes = inside.sum() / RATE_HZ / 60.0
            rows.append(f"| {name} | {minutes:.1f} | {who} | {_cells(new, old, inside)} |")
    return "\n".join(rows)


def _cells(new: Errors, old: Errors, inside: Bools) -> str:
    def mean(errors: Errors, name: str) -> float:
        return float(np.nanmean(getattr(errors, name)[inside]))

    def ratio(name: str) -> str:
        return f"{mean(new, name) / mean(old, name):.2f}"

    toes, legs, speed = (mean(new, name) for name in ("toes_cm", "legs_deg", "speed_cm_s"))
    return (
        f"{toes:.2f} | {ratio('toes_cm')} | {legs:.2f} | {ratio('legs_deg')} "
        f"| {100.0 * _balanced(new, inside):.1f} | {speed:.1f} | {ratio('speed_cm_s')} "
        f"| {mean(new, 'shown_cm'):.2f} | {mean(new, 'skate_cm_s'):.1f}"
    )


def _balanced(errors: Errors, inside: Bools) -> float:
    # skate is known exactly where the truth is in contact
    on = np.isfinite(errors.skate_cm_s[inside])
    recalls = errors.right_on[inside][on], errors.right_off[inside][~on]
    return float(np.mean([r.mean() for r in recalls if len(r)]))


def _delay_table(args: argparse.Namespace, delays: dict[str, list[Array]]) -> str:
    rows = ["| median / 90th percentile, ms | steps | " + args.predictor + " | " + args.against]
    rows[0] += " |"
    rows.append("|---|---|---|---|")
    for title, (new, old) in delays.items():
        cells = [f"{np.median(d):.0f} / {np.percentile(d, 90.0):.0f}" for d in (new, old)]
        rows.append(f"| {title} | {len(new)} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _studio_table(
    args: argparse.Namespace, clips: Sequence[Clip], means: dict[str, list[float]]
) -> str:
    minutes = sum(len(clip.truth) - NOT_SCORED for clip in clips) / RATE_HZ / 60.0
    base = means[PARTS["test"]]
    rows = [
        f"{len(clips)} clips, {minutes:.1f} minutes; used for nothing but this row.\n",
        f"| toes of the network, cm | {args.predictor} | of `test` | {args.against} | of `test` |",
        "|---|---|---|---|---|",
    ]
    for title, values in means.items():
        cells = [f"{v:.2f} | {v / b:.2f}" for v, b in zip(values, base, strict=True)]
        rows.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _head(args: argparse.Namespace) -> str:
    studio = " ".join(path.name for path in args.other_studio)
    command = "python tools/activity_table.py DATA" + (
        f" --other-studio {studio}" if studio else ""
    )
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

`{command}`, {date}:
`{args.predictor}`, carried, against `{args.against}`
on the same clips. Trackers from the truth, as in the tables of the networks. What people do is told
frame by frame (lobstr_hw/evaluation/activities.py); the trackers do not tell a chair, so
sitting and crouching share rows. Balanced accuracy is of the network's contacts.
"""


if __name__ == "__main__":
    raise SystemExit(main())
