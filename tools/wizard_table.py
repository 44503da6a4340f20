"""The wizard from end to end: many simulated users are led through it, on a virtual clock.

    python tools/wizard_table.py --users 500 --cases 120 --seed 8000 [--write]

Everything but the terminal and the clock is what `lobstr-calibrate` runs. Seeds under 1000 are for
choosing, those from 8000 for reporting.
"""

import argparse
import datetime
import json
import re
from collections import Counter
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from movement_table import ROWS
from results_page import write_section
from self_check_table import wilson
from wizard_actor import STEP_S, Actor, Play, Played
from wizard_mistakes import GOOD, KINDS

from lobstr_hw.calibration import Calibration, movement_from_samples, refine_by_movement
from lobstr_hw.calibration.profile import profile_to_json
from lobstr_hw.rotations import geodesic_angle, rotation_mean
from lobstr_hw.simulation import SimulatedTake

TITLE = "## The wizard from end to end"
SETTLED = (0.01, np.deg2rad(3.0))
DONE = "done"
SEEDS_APART = 1000
LOOK_EVERY = 5
"""Every fifth profile is made once more by the pure functions."""


@dataclass(frozen=True)
class Outcome:
    """What came of one person, in few numbers: takes are large.

    Attributes:
        posed_s, done_s: after standing ready; never (infinite) where it was not.
        how: how it ended.
        told: the reason that was given.
        asked: something was asked for once more.
        same: the profile is what the pure functions make of the same samples; None: not looked at.
        errors: of the profile, in the order of ROWS.
    """

    posed_s: float
    done_s: float
    how: str
    told: str
    asked: bool
    same: bool | None
    errors: tuple[float, ...]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--users", type=int, default=500)
    parser.add_argument("--cases", type=int, default=120, help="of each kind of mistake")
    parser.add_argument("--seed", type=int, default=8000)
    parser.add_argument("--kept", type=Path, help="outcomes so far: it goes on where it was")
    parser.add_argument("--no-more", action="store_true", help="only what is in that file")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    kept = Kept(args.kept)
    # a few of each in turn, so that one that is stopped has something of all
    counts = {name: args.users if name == GOOD else args.cases for name in KINDS}
    for i in range(0 if args.no_more else max(counts.values())):
        for k, name in enumerate(KINDS):
            if i < counts[name]:
                kept.outcome(name, args.seed + SEEDS_APART * k + i)
    text = "\n".join([_head(args), *_good(kept.of(GOOD)), "", *_wrong(kept), ""])
    print(text)
    if args.write:
        write_section(text)
    return 0


class Kept:
    """Outcomes by kind and seed; in a file, one a line, if there is one."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._known: dict[tuple[str, int], Outcome] = {}
        if path is not None and path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                name, seed, fields = json.loads(line)
                fields["errors"] = tuple(fields["errors"])
                self._known[name, seed] = Outcome(**fields)

    def outcome(self, name: str, seed: int) -> Outcome:
        if (name, seed) not in self._known:
            actor = KINDS[name](seed)
            found = self._known[name, seed] = _outcome(actor, Play(actor).run())
            if self._path is not None:
                with self._path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps([name, seed, asdict(found)]) + "\n")
        return self._known[name, seed]

    def of(self, name: str) -> list[Outcome]:
        return [found for (kind, _), found in self._known.items() if kind == name]


def _good(outcomes: list[Outcome]) -> list[str]:
    """Times, refusals, and what the profiles are worth."""
    done = [o for o in outcomes if o.how == DONE]
    n = len(outcomes)
    why = Counter(f"{o.how}: {o.told}" for o in outcomes if o.how != DONE)
    rows = [
        "| of those who do it right | |",
        "|---|---|",
        f"| T-pose taken, after standing ready | {_times([o.posed_s for o in done])} |",
        f"| all done, after standing ready | {_times([o.done_s for o in done])} |",
        f"| refused | {_share(n - len(done), n)} {_named(why)} |",
        f"| something was asked for once more | {sum(o.asked for o in done)} of {len(done)} |",
        f"| the profile is what the pure functions make of the same samples | "
        f"{sum(o.same is True for o in done)} of {sum(o.same is not None for o in done)} |",
        "",
        "| median / 95th percentile | error of the profile | wanted |",
        "|---|---|---|",
    ]
    for i, (name, _, wanted) in enumerate(ROWS):
        values = [o.errors[i] for o in done]
        if wanted:
            rows.append(
                f"| {name} | {np.median(values):.2f} / {np.percentile(values, 95.0):.2f} | "
                f"{wanted} |"
            )
    missed = [
        name
        for i, (name, _, wanted) in enumerate(ROWS)
        if wanted and np.median([o.errors[i] for o in done]) > float(wanted)
    ]
    return [*rows, "", f"Over what is wanted, in the median: {', '.join(missed) or 'none'}."]


def _times(seconds: list[float]) -> str:
    return (
        f"median {np.median(seconds):.1f} s, 95 % within {np.percentile(seconds, 95.0):.1f} s, "
        f"worst {np.max(seconds):.1f} s"
    )


def _named(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common(4))


def _share(k: int, n: int) -> str:
    low, high = wilson(k, n)
    return f"{k} of {n}, {100.0 * k / n:.1f} % ({100.0 * low:.1f} to {100.0 * high:.1f})"


def _same(p: Played) -> bool:
    """The pure functions, given the T-pose and the samples since, make the same profile."""
    pose, found = p.person.t_pose, p.person.calibration
    assert pose is not None and found is not None
    begin_s = p.person.movement[0].time_s
    recording = movement_from_samples(p.samples, pose.serials, begin_s)
    again = refine_by_movement(pose, recording.between(pose.end_s)).calibration
    return profile_to_json(again) == profile_to_json(found)


def _wrong(kept: Kept) -> list[str]:
    rows = [
        "| what they do wrong | no wrong profile | how | what the person is told |",
        "|---|---|---|---|",
    ]
    for name in KINDS:
        outcomes = kept.of(name)
        if name == GOOD or not outcomes:
            continue
        how = Counter(o.how for o in outcomes)
        told = Counter(o.told for o in outcomes if o.told)
        share = _share(len(outcomes) - how[DONE], len(outcomes))
        rows.append(f"| {name} | {share} | {_named(how)} | {_named(told)} |")
    return rows


def _outcome(actor: Actor, p: Played) -> Outcome:
    how, told = _ending(actor, p)
    found = p.person.calibration
    errors = () if found is None else tuple(_errors(p.take, found))
    asked = any(words.startswith("Once more") for words in p.instructions)
    same = _same(p) if p.done_s < np.inf and actor.seed % LOOK_EVERY == 0 else None
    return Outcome(p.posed_s - p.ready_s, p.done_s - p.ready_s, how, told, asked, same, errors)


def _errors(take: SimulatedTake, found: Calibration) -> list[float]:
    return [float(np.mean(np.asarray(error(take, found)))) for _, error, _ in ROWS]


def _ending(actor: Actor, p: Played) -> tuple[str, str]:
    """How it ended, and what was said about it."""
    if p.refused:
        return "refused by the self-check", re.split(r" -?[0-9.]+ ", p.refused)[0]
    if p.stuck:
        step, advice = p.stuck.split(": ", 1)
        return f"never past {step}", advice
    if actor.settled is not None and _settled(actor, p):
        return "pose taken as the tracker sits since", ""
    return DONE, ""


def _settled(actor: Actor, p: Played) -> bool:
    """The pose that was taken is that after the mishap: what is calibrated is right."""
    pose = p.person.t_pose
    assert pose is not None and actor.settled is not None
    take = replace(actor, mishap=actor.settled).take(p.reached_s - STEP_S, None)
    seen = (take.times_s >= pose.start_s) & (take.times_s <= pose.end_s)
    off_m = np.linalg.norm(np.median(take.p[seen], axis=0) - pose.p, axis=-1)
    off_rad = geodesic_angle(rotation_mean(take.R[seen]), pose.R)
    return bool(np.all(off_m < SETTLED[0]) and np.all(off_rad < SETTLED[1]))


def _head(args: argparse.Namespace) -> str:
    command = (
        f"python tools/wizard_table.py --users {args.users} --cases {args.cases} --seed {args.seed}"
    )
    stopped = " (stopped before its end: the rows say how many it had)" if args.no_more else ""
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

Simulated users as under Calibration with movement, led through the steps of `lobstr-calibrate` on a
virtual clock: they stand at ease, raise their arms 0.8 to 2 s after they are asked to, hold them
until they are told that it is enough, and move 0.4 to 1.2 s later as they like; nobody presses
anything, so every part of the movement takes its whole time, and what was missing is asked for but
not done again. Samples at 45 Hz with Lighthouse errors. Who does something wrong goes on doing it
for 12 s; "never past" a step means that it was not accepted in that time.

`{command}`, {date}{stopped}.
"""


if __name__ == "__main__":
    raise SystemExit(main())
