"""``lobstr-live``: from trackers to a full body, as long as you like."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from lobstr_hw.runtime.commands.ending import ended
from lobstr_hw.runtime.commands.numbers import between, zero_or_more
from lobstr_hw.runtime.outputs.sinks import SINKS, SinkSpec, parse_sink
from lobstr_hw.runtime.stopping import StopRequest

if TYPE_CHECKING:
    from lobstr_hw.drivers.driver import TrackerDriver
    from lobstr_hw.runtime.controls import Say
    from lobstr_hw.runtime.live import LiveOptions
    from lobstr_hw.runtime.summary import Summary

__all__ = ["main"]

BUNDLED = ""
RATES_HZ = (12.0, 1000.0)
"""Slower, and a tick would have to make up more grid steps than it may."""

EXAMPLES = """examples:
  lobstr-live --sim                         the bundled recording, in real time
  lobstr-live --sim take.mcap --fast --output bvh:out.bvh --summary s.json
  lobstr-live --driver fake --output ndjson:- --duration 10
  lobstr-live --driver openvr --driver polhemus:port=/dev/ttyUSB0,role=pelvis
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    parser = _parser()
    args = parser.parse_args(argv)
    _check(parser, args)
    return ended(
        lambda stop: _run(args, stop), _tell, as_json=args.json, stopped="stopped at once."
    )


def _tell(message: str) -> None:
    print(f"lobstr-live: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-live",
        description="Full-body skeleton from a headset, two controllers and a pelvis tracker.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("--sim", nargs="?", const=BUNDLED, metavar="LOG", help="replay a tracker log (bundled one)")
    add("--fast", action="store_true", help="with --sim: as fast as possible, on the log's clock")
    add("--driver", action="append", default=[], metavar="NAME[:k=v,...]", help="listen to devices")
    add("--profile", type=Path, metavar="FILE", help="calibration profile; without: do a T-pose")
    add("--predictor", default="lobstr", metavar="NAME|FILE", help="moves the legs (lobstr)")
    add(
        "--rate",
        type=between(*RATES_HZ, "Hz"),
        default=45.0,
        metavar="HZ",
        help="frames per second (45)",
    )
    add("--input-delay", type=zero_or_more, default=10.0, metavar="MS", help="of the legs (10)")
    add(
        "--output",
        action="append",
        default=[],
        type=_sink,
        metavar="SINK",
        help=f"NAME:FILE with NAME one of {', '.join(SINKS)}; may be repeated",
    )
    add("--take", metavar="NAME", help="name of this recording")
    add("--duration", type=zero_or_more, metavar="S", help="seconds from the first frame")
    add("--summary", type=Path, metavar="FILE", help="write a JSON summary at the end")
    add("--no-speech", action="store_true", help="bells only, no words for somebody in a headset")
    add("--quiet", action="store_true", help="no status line and no closing words")
    add("--json", action="store_true", help="the summary on stdout, as one JSON document")
    return parser


def _sink(text: str) -> SinkSpec:
    try:
        return parse_sink(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _check(parser: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Wrong use that no single argument shows."""
    targets = [spec.rest for spec in args.output]
    if args.sim is not None and args.driver:
        parser.error("--sim is a source of its own; leave --driver out")
    if args.fast and args.sim is None:
        parser.error("--fast goes with --sim only: devices have their own time")
    if args.json and "-" in targets:
        parser.error("--json and ndjson:- both want stdout; write ndjson to a file")
    if len(set(targets)) < len(targets):
        parser.error("two outputs write to the same file")


def _run(args: argparse.Namespace, stop: StopRequest) -> int:
    from lobstr_hw.runtime.live import LiveSession
    from lobstr_hw.runtime.summary import check_summary_path, write_summary

    if args.summary is not None:
        check_summary_path(args.summary)
    driver = _driver(args)
    if driver is None:
        return 2
    with _voice(args) as say, LiveSession(driver, _options(args), _tell, say=say) as live:
        try:
            live.run(stop)
        finally:
            summary = live.summary()
            if args.summary is not None:
                write_summary(args.summary, summary)
    _close(args, summary)
    return 0


def _driver(args: argparse.Namespace) -> "TrackerDriver | None":
    from lobstr_hw.drivers.replay import ReplayDriver
    from lobstr_hw.runtime.sources import bundled_log, drivers_from_specs

    if args.sim is not None:
        return ReplayDriver(bundled_log() if args.sim == BUNDLED else Path(args.sim))
    try:
        return drivers_from_specs(args.driver, _tell)
    except ValueError as error:
        _tell(f"{error}")
        return None


@contextmanager
def _voice(args: argparse.Namespace) -> "Iterator[Say | None]":
    """Who tells somebody in a headset; with --fast there is nobody in one."""
    from lobstr_hw.runtime.announcer import Announcer, Spoken

    if args.fast:
        yield None
        return
    with Announcer(speech=not args.no_speech) as announcer:

        def say(spoken: Spoken) -> None:
            announcer.say(spoken)
            if not args.quiet:
                _tell(spoken.text)

        yield say


def _options(args: argparse.Namespace) -> "LiveOptions":
    from lobstr_hw.runtime.live import LiveOptions

    log = args.sim or ("demo" if args.sim is not None else "live")
    return LiveOptions(
        profile=args.profile,
        predictor=args.predictor,
        rate_hz=args.rate,
        input_delay_s=1e-3 * args.input_delay,
        outputs=tuple(args.output),
        take=args.take or Path(log).stem,
        duration_s=args.duration,
        fast=args.fast,
        quiet=args.quiet,
    )


def _close(args: argparse.Namespace, summary: "Summary") -> None:
    if args.json:
        print(json.dumps(asdict(summary)))
    if not args.quiet:
        for line in _closing_words(args, summary):
            _tell(line)


def _closing_words(args: argparse.Namespace, summary: "Summary") -> list[str]:
    tick = summary.tick_ms
    lines = [
        f"{summary.frames} frames, {summary.duration_s:.1f} s at {summary.rate_hz:g} Hz; a tick "
        f"takes {tick['p50'] or 0.0:.1f} ms (p99 {tick['p99'] or 0.0:.1f}); "
        f"{summary.overruns} overruns"
    ]
    troubles = [f"{name} {count}" for name, count in summary.gate_events.items()]
    if troubles:
        lines.append("poses not believed: " + ", ".join(troubles))
    return lines + [f"written: {spec.rest}" for spec in args.output if spec.rest != "-"]


if __name__ == "__main__":
    sys.exit(main())
