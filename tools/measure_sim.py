"""What `lobstr-live --sim` gives on a log: the table of docs/results.md.

    python tools/measure_sim.py [LOG] [--rate HZ] [--write]

Hands and head are compared with their calibrated targets (what the devices say, through the
calibration) and with the joints of the motion that the log was made from, where it has them.
"""

import argparse
import datetime
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from results_page import write_section

from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.drivers.tracker_log import TrackerLog
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.sources import bundled_log
from lobstr_hw.skeleton import HEEL, PARENTS, TOE_TIP, Body, Joint, global_rotations
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import ROLE_JOINT, TrackerRole, TrackerSample

TARGETS = (TrackerRole.HEAD, TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND)
CHAINS = {
    TrackerRole.HEAD: (Joint.CHEST, Joint.UPPER_CHEST, Joint.NECK, Joint.HEAD),
    TrackerRole.LEFT_HAND: (Joint.LEFT_LOWER_ARM, Joint.LEFT_HAND),
    TrackerRole.RIGHT_HAND: (Joint.RIGHT_LOWER_ARM, Joint.RIGHT_HAND),
}
"""The bones that reach for a target; they hang on the parent of the first."""
LEGS = list(range(Joint.LEFT_UPPER_LEG, Joint.RIGHT_TOES + 1))
TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]
FEET = [Joint.LEFT_FOOT, Joint.RIGHT_FOOT]


@dataclass(slots=True)
class Capture:
    """An output that keeps the calibrated poses, and the targets at their times."""

    live: LiveSession
    poses: list[SkeletonPose] = field(default_factory=list)
    targets: list[Array] = field(default_factory=list)
    measured: list[Bools] = field(default_factory=list)

    def open(self, body: Body, rate_hz: float, take: str) -> None:
        """Nothing to open."""

    def calibrated(self, body: Body) -> None:
        """Nothing to do: the session knows."""

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        """Keep a pose and where its hands and head should be."""
        calibration = self.live.session.calibration
        if calibration is None:
            return
        seen = self.live.feed.at((pose.time_s,))
        frame = calibration.frame(
            pose.time_s, self.live.feed.roles, seen.p, seen.R, seen.valid_p, seen.valid_R
        )
        at = [frame.index(role) for role in TARGETS]
        self.poses.append(pose)
        self.targets.append(frame.p[0, at] / calibration.scale)
        self.measured.append(frame.valid_p[0, at])

    def close(self) -> None:
        """Nothing to close."""


def main() -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", nargs="?", type=Path, default=bundled_log())
    parser.add_argument("--rate", type=float, default=45.0)
    parser.add_argument("--write", action="store_true", help="put it into docs/results.md")
    args = parser.parse_args()
    options = LiveOptions(rate_hz=args.rate, fast=True, quiet=True)
    with LiveSession(ReplayDriver(args.log), options, print) as live:
        assert isinstance(live.driver, ReplayDriver)
        log = live.driver.log
        capture = Capture(live)
        live.outputs.append(capture)
        live.run(lambda: False)
    rows = (*summary_rows(live), *body_rows(live, capture), *truth_rows(log, capture))
    lines = [f"{args.log.name}: {log.duration_s:.1f} s, {args.rate:g} Hz", ""]
    lines += ["| what | value |", "|---|---|", *(f"| {what} | {value} |" for what, value in rows)]
    text = "\n".join([_head(), *lines])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _head() -> str:
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""## lobstr-live --sim

`python tools/measure_sim.py`, {date}: the bundled log through the whole program, in-process, with
the shipped network (times on a busy two-core machine). Two runs of `lobstr-live --sim --fast
--output bvh:out.bvh` give byte-identical files (`cmp`). The shown body is held against its
calibrated targets, where they are in sight, and against the source motion's own joints (`/truth`
of the log).
"""


def summary_rows(live: LiveSession) -> list[tuple[str, str]]:
    """What the run itself counted."""
    summary = live.summary()
    return [
        ("frames", f"{summary.frames}"),
        ("calibrated after", f"{summary.calibrated_at_s:.2f} s"),
        ("non-finite frames", f"{summary.nonfinite_frames}"),
        ("gate events", ", ".join(f"{k} {v}" for k, v in summary.gate_events.items()) or "none"),
        (
            "a tick's work, p50 / p99",
            f"{summary.tick_ms['p50']:.2f} / {summary.tick_ms['p99']:.2f} ms",
        ),
        (
            "skate in contact, left / right",
            " / ".join("-" if v is None else f"{v:.1f}" for v in summary.foot_skate_cm_s.values())
            + " cm/s",
        ),
    ]


def body_rows(live: LiveSession, capture: Capture) -> list[tuple[str, str]]:
    """Bones, targets and soles."""
    body = live.session.body
    p = np.concatenate([pose.p_world for pose in capture.poses])
    R = global_rotations(np.concatenate([pose.R_local for pose in capture.poses]))
    bones = np.linalg.norm(p[:, 1:] - p[:, PARENTS[1:]], axis=-1)
    deviation = np.abs(bones - np.linalg.norm(body.offsets[0, 1:], axis=-1)).max()
    rows = [("bone length deviation, max", f"{deviation:.1e} m")]
    targets, measured = np.stack(capture.targets), np.stack(capture.measured)
    for i, role in enumerate(TARGETS):
        there = measured[:, i]  # what is out of sight is shown where the body goes
        off = np.linalg.norm(p[there, ROLE_JOINT[role]] - targets[there, i], axis=-1)
        near = in_reach(role, p[there], targets[there, i], body)
        inside = f"{1e3 * off[near].max():.2f} mm" if near.any() else "never in reach"
        rows.append((f"{role} to its target, in reach, max", inside))
        short = f", by {1e3 * np.median(off[~near]):.1f} / {1e3 * off[~near].max():.1f} mm"
        share = f"{100.0 * np.mean(~near):.1f} % of the frames"
        rows.append(
            (f"{role} out of reach, by median / max", share + (short if (~near).any() else ""))
        )
    rows.append(("lowest sole point", f"{1e3 * lowest_sole_m(p, R, body):.1f} mm"))
    return rows


def in_reach(role: TrackerRole, p: Array, target: Array, body: Body) -> Bools:
    """Frames in which the stretched chain, from where it hangs now, gets to the target."""
    chain = CHAINS[role]
    lengths = np.linalg.norm(body.offsets[0, chain, :], axis=-1).sum()
    near: Bools = np.linalg.norm(target - p[:, PARENTS[chain[0]]], axis=-1) <= lengths
    return near


def lowest_sole_m(p: Array, R: Array, body: Body) -> float:
    """Height of the lowest of heels, balls and tips, the flesh under the joints counted."""
    size = body.sole[0] / 0.020
    heel = p[:, FEET] + size * (R[:, FEET] @ HEEL)
    tip = p[:, TOES] + size * (R[:, TOES] @ TOE_TIP)
    ball_y = p[:, TOES, 1] - body.sole[0]
    return float(min(heel[..., 1].min(), tip[..., 1].min(), ball_y.min()))


def truth_rows(log: TrackerLog, capture: Capture) -> list[tuple[str, str]]:
    """Distances from the joints of the source motion."""
    if log.truth is None:
        return [("against the source motion", "the log has none")]
    times = np.array([pose.time_s for pose in capture.poses])
    p = np.concatenate([pose.p_world for pose in capture.poses])
    truth = between(times, log.truth.times_s, log.truth.p_world)
    off = 100.0 * np.linalg.norm(p - truth, axis=-1)
    groups: dict[str, list[int]] = {role.value: [ROLE_JOINT[role]] for role in TARGETS}
    groups |= {"hips": [Joint.HIPS], "toe bases": [*TOES], "legs, all joints": LEGS}
    groups |= {"whole body": list(range(22))}
    rows = [
        (f"{name} to the source motion, median / p95", quantiles(off[:, joints]))
        for name, joints in groups.items()
    ]
    relative = (p - p[:, :1]) - (truth - truth[:, :1])
    toes = 100.0 * np.linalg.norm(relative[:, TOES], axis=-1)
    return [*rows, ("toe bases, hips laid over each other, median / p95", quantiles(toes))]


def between(times_s: Array, at_s: Array, values: Array) -> Array:
    """Values (f, ...) at other times, linearly."""
    i = np.clip(np.searchsorted(at_s, times_s, "right") - 1, 0, len(at_s) - 2)
    f = ((times_s - at_s[i]) / (at_s[i + 1] - at_s[i]))[:, None, None]
    return np.asarray((1.0 - f) * values[i] + f * values[i + 1])


def quantiles(values: Array) -> str:
    """Median and 95th percentile in centimetres."""
    median, p95 = np.percentile(values, (50, 95))
    return f"{median:.1f} / {p95:.1f} cm"


if __name__ == "__main__":
    sys.exit(main())
