"""lobstr-evaluate: the scores of a predictor on motion clips."""

import argparse
import csv
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from lobstr_hw.errors import FileFormatError, LobstrError
from lobstr_hw.evaluation.clip_pictures import plot_clip
from lobstr_hw.evaluation.evaluate import evaluate
from lobstr_hw.evaluation.plots import plot_results
from lobstr_hw.evaluation.rollout import Mode
from lobstr_hw.evaluation.tables import ClipResult, document, markdown_table, total
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.predictors import PREDICTOR_NAMES, Predictor, load_predictor
from lobstr_hw.retargeting import Note, find_clips, retarget
from lobstr_hw.runtime.stopping import StopRequest
from lobstr_hw.splits import PARTS, Split, clip_name, default_split, read_split

__all__ = ["main"]

EXAMPLES = """examples:
  lobstr-evaluate DATA/snu_tennis                      scores of the shipped network, as JSON
  lobstr-evaluate DATA --part test --table             the default split's test part, as a table
  lobstr-evaluate walk.bvh --scale 0.01 --plots plots  one clip in centimetres, with pictures
"""
TRIVIAL = ("standing", "mean_pose")


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.trackers != 4:
        parser.error("the predictors of this version need --trackers 4 (head, hands, pelvis)")
    if options.scale is not None and not options.scale > 0.0:
        parser.error("--scale is metres per unit of the file, over 0")
    try:
        with StopRequest() as stop:
            return _evaluate(options, stop)
    except LobstrError as error:
        print(f"lobstr-evaluate: {error}", file=sys.stderr)
        return 1
    except _Stopped:
        print("lobstr-evaluate: stopped", file=sys.stderr)
        return 0


class _Stopped(Exception):
    """Ctrl-C or SIGTERM while scoring."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-evaluate",
        description="Score a predictor on motion clips (BVH). Prints one JSON document.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("paths", nargs="+", metavar="PATH", help="BVH files or folders")
    parser.add_argument(
        "--predictor", default="lobstr", help=f"{', '.join(PREDICTOR_NAMES)} or FILE.onnx"
    )
    parser.add_argument("--trackers", type=int, default=4, choices=(3, 4, 6), help="how many")
    parser.add_argument(
        "--mode",
        choices=("carried", "windowed"),
        default="carried",
        help="carried: one step per frame, what ships; windowed: 45 frames from zero each time",
    )
    parser.add_argument("--scale", type=float, metavar="M", help="metres per unit of the files")
    parser.add_argument("--split", type=Path, metavar="FILE", help="clips by part (JSON)")
    parser.add_argument("--part", choices=PARTS, help="score only this part of the split")
    parser.add_argument(
        "--plots",
        type=Path,
        metavar="DIR",
        help="write pictures there: scores by clip; of the longest one its error over time, its "
        "contacts and a strip of its legs",
    )
    parser.add_argument("--table", action="store_true", help="a table with trivial rows instead")
    parser.add_argument("--json", action="store_true", help="JSON on stdout (as without --table)")
    return parser


def _evaluate(options: argparse.Namespace, stop: StopRequest) -> int:
    predictor = load_predictor(options.predictor)
    clips = _clips(options, stop)
    results = _score(options.predictor, predictor, clips, options.mode, stop)
    if options.plots:
        plot_results(options.plots, results)
        plot_clip(options.plots, max(clips, key=len), predictor, options.mode)
    if options.table:
        table = _table(options, results, clips, stop)
        print(table, file=sys.stderr if options.json else sys.stdout)
    if options.json or not options.table:
        print(json.dumps(document(results), indent=1))
    return 0


def _clips(options: argparse.Namespace, stop: StopRequest) -> list[Truth]:
    split = _split(options)
    found = find_clips(options.paths, options.scale)
    _note_missing_files(options.paths)
    if split is not None:
        wanted = {clip.name for clip in found} & split.parts[options.part]
        if not wanted:
            raise FileFormatError(
                f"no clip of the part {options.part!r} of the split {split.name!r} was found. "
                "A clip is named after its folder: FOLDER/clips/NAME.bvh is FOLDER/NAME."
            )
        sets = {name.split("/")[0] for name in wanted}
        # frames are fitted from all clips given: the same as in training
        found = [clip for clip in found if clip.set_name in sets]
    truths = []
    for motion in retarget(found, progress=_progress_retargeting, notes=_note):
        _end_if(stop)
        if split is None or clip_name(motion.name) in wanted:
            truths.append(Truth.of(motion))
    if not truths:
        raise FileFormatError("no clip is left to score: all of them are known to be faulty.")
    return truths


def _split(options: argparse.Namespace) -> Split | None:
    if not options.part:
        if options.split:
            raise FileFormatError(f"--split needs --part {'|'.join(PARTS)}: which clips to score.")
        return None
    return read_split(options.split) if options.split else default_split()


def _note_missing_files(paths: Sequence[str]) -> None:
    """A row of a manifest without its file is told; the clips are the files found."""
    for manifest in sorted(m for p in map(Path, paths) for m in p.rglob("manifest.csv")):
        with manifest.open(encoding="utf-8", newline="") as file:
            names = [row.get("file") or "" for row in csv.DictReader(file)]
        missing = [name for name in names if name and not (manifest.parent / name).is_file()]
        if missing:
            _say(f"{manifest}: {len(missing)} rows without their file, the first {missing[0]}")


def _score(
    name: str, predictor: Predictor, clips: list[Truth], mode: Mode, stop: StopRequest
) -> list[ClipResult]:
    frames = 2 * sum(len(clip) for clip in clips)
    done = 0

    def count(more: int) -> None:
        nonlocal done
        _end_if(stop)
        before, done = done, done + more
        if 10 * before // frames != 10 * done // frames:
            _say(f"{name} {mode}: {100 * done // frames} %")

    return evaluate(predictor, clips, mode, count)


def _table(
    options: argparse.Namespace, results: list[ClipResult], clips: list[Truth], stop: StopRequest
) -> str:
    rows = [(f"{options.predictor}, {options.mode}", results)]
    for name in TRIVIAL:
        if name != options.predictor:
            rows.append((name, _score(name, load_predictor(name), clips, "carried", stop)))
    lines = []
    for label, clip_results in rows:
        whole = total(clip_results).scores()
        lines.append((f"{label}, network", whole["network"]))
        lines.append((f"{label}, after IK", whole["after_ik"]))
    frames = total(results).network.frames
    head = f"{len(clips)} clips, {frames} frames scored ({frames / 45.0 / 60.0:.1f} minutes)"
    return f"{head}\n\n{markdown_table(lines)}"


def _end_if(stop: StopRequest) -> None:
    if stop():
        raise _Stopped


def _progress_retargeting(done: int, count: int, name: str) -> None:
    if 10 * (done - 1) // count != 10 * done // count:
        _say(f"retargeting: {done} of {count} clips")


def _note(note: Note) -> None:
    _say(f"{note.clip}: {note.text}")


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
