"""``lobstr-log make``: a tracker log from a motion clip, as if someone had worn trackers in it."""

import argparse
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path

import numpy as np

from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.errors import MotionFileError
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import ClipFile, Note, find_clips, retarget
from lobstr_hw.rotations import to_quat_xyzw
from lobstr_hw.runtime.commands.log_report import Report, Step, Subparsers, progress_bar, whole_file
from lobstr_hw.runtime.commands.numbers import above_zero, between
from lobstr_hw.simulation import SimulatedTake, SimulatedUser, joined, simulate, take_samples
from lobstr_hw.trackers import FOUR_POINTS, TrackerSample, TrackingState

__all__ = ["add_parser", "clip_motion", "run", "write_take"]

EXAMPLE = "example: lobstr-log make walk.bvh walk.mcap --scale 0.01 --height 172 --seed 7"
BATCH_S = 0.5
"""Samples and truth are interleaved by so much, so that viewers find one time in one place."""


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """The options of ``make``."""
    parser = subparsers.add_parser(
        "make",
        help="a log from a BVH clip",
        description="Strap trackers on the person of a clip: unknown mounts, tracking errors, "
        "and a T-pose of 3 s before the motion. The same seed makes the same log.",
        epilog=EXAMPLE,
    )
    parser.add_argument("clip", type=Path, metavar="CLIP.bvh", help="of any known rig")
    parser.add_argument("out", type=Path, metavar="OUT.mcap", help="the log to write")
    parser.add_argument(
        "--scale",
        type=above_zero,
        metavar="METRES_PER_UNIT",
        help="of the clip's lengths (told from its legs otherwise)",
    )
    parser.add_argument("--seed", type=int, default=0, help="of everything random (0)")
    parser.add_argument(
        "--height",
        type=between(100.0, 230.0, "cm"),
        metavar="CM",
        help="stature of the user (drawn, 150 to 195)",
    )
    parser.add_argument(
        "--rate", type=above_zero, default=90.0, metavar="HZ", help="of the trackers (90)"
    )
    return parser


def run(options: argparse.Namespace) -> Report:
    """Make the log."""
    with progress_bar("reading the clip") as step:
        motion = clip_motion(options.clip, options.scale)
        step(0, what="simulating trackers")
        take = simulate(motion, options.seed, options.height, options.rate)
        words = {
            "clip": options.clip.name,
            "seed": str(options.seed),
            "height_cm": "drawn" if options.height is None else f"{options.height:g}",
            "rate_hz": f"{options.rate:g}",
        }
        with whole_file(options.out) as part:
            write_take(part, take, words, step)
    document = {
        "file": str(options.out),
        "bytes": options.out.stat().st_size,
        "duration_s": round(float(take.times_s[-1]), 3),
        "samples": int(take.tracked.size),
        "stature_cm": round(100.0 * take.user.stature_m, 1),
        "serials": {role.value: serial for role, serial in take.serials.items()},
    }
    text = (
        f"{options.out}: {document['duration_s']:.1f} s of {len(FOUR_POINTS)} trackers at "
        f"{options.rate:g} Hz, {document['bytes'] / 1e6:.2f} MB, worn by someone of "
        f"{document['stature_cm']:.0f} cm.\nNext: lobstr-live --sim {options.out}"
    )
    return Report(text, document)


def clip_motion(path: Path, metres_per_unit: float | None = None) -> Motion:
    """A clip on the standard skeleton; its good pieces joined where faults are cut out.

    Raises:
        FileFormatError: no such file, not BVH, or a rig nobody knows.
        MotionFileError: the clip is known to be unusable.
    """
    clips = find_clips([path], metres_per_unit)
    if len(clips) > 1:
        raise MotionFileError(f"{path} holds {len(clips)} clips. Name one of them.")
    notes: list[Note] = []
    found = retarget([clips[0], *_same_person(clips[0])], notes=notes.append)
    motions = list(takewhile(lambda motion: motion.name.split("#")[0] == clips[0].name, found))
    if not motions:
        why = "; ".join(note.text for note in notes if note.clip == clips[0].name)
        raise MotionFileError(f"{path}: {why or 'no good frames'}. Take another clip.")
    return motions[0] if len(motions) == 1 else joined(motions)


def _same_person(clip: ClipFile) -> list[ClipFile]:
    """The other clips in the folder of the person whom the manifest names.

    How the bones of a rig lie in a person is told from all that this person does: from one clip
    alone arms come out up to 30 degrees off.
    """
    if clip.subject == clip.set_name:  # no manifest: these may be anybody's
        return []
    others = find_clips([clip.path.parent])
    return [o for o in others if o.subject == clip.subject and o.path != clip.path]


def write_take(path: Path, take: SimulatedTake, words: dict[str, str], step: Step) -> None:
    """Write a simulated take as a log, with its truth."""
    with TrackerLogWriter(path) as writer:
        writer.metadata("made", words)
        writer.metadata("user", _user(take.user))
        if take.t_pose_s[1] > take.t_pose_s[0]:
            writer.mark_t_pose(*take.t_pose_s)
        for role in FOUR_POINTS:
            writer.add_state(take.serials[role], role, TrackingState.OK, True, 0.0)
        end_s = float(take.times_s[-1])
        truth = 0
        for samples in _batches(take):
            writer.add_samples(samples)
            last_s = samples[-1].time_s
            while truth < len(take.truth_times_s) and take.truth_times_s[truth] <= last_s:
                writer.add_truth(
                    float(take.truth_times_s[truth]), take.truth_p[truth], take.truth_R[truth]
                )
                truth += 1
            step(last_s, end_s, "writing the log")


def _batches(take: SimulatedTake) -> Iterator[list[TrackerSample]]:
    """The samples, half a second at a time."""
    batch: list[TrackerSample] = []
    for sample in take_samples(take):
        if batch and sample.time_s - batch[0].time_s >= BATCH_S:
            yield batch
            batch = []
        batch.append(sample)
    yield batch


def _user(user: SimulatedUser) -> dict[str, str]:
    """What calibration has to find out: sizes, and where each tracker sits on its joint."""
    words = {
        "stature_m": f"{user.stature_m:.4f}",
        "hips_height_m": f"{1.0 / user.body.scale[0]:.4f}",
    }
    for role, mount in user.mounts.items():
        numbers = np.concatenate([mount.p, to_quat_xyzw(mount.R)])
        words[f"T_{role.value}_tracker"] = " ".join(f"{v:.6f}" for v in numbers)
    return words
