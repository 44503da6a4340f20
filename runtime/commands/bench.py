"""``lobstr-bench``: how fast this machine does the work."""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from lobstr_hw.runtime.commands.ending import ended
from lobstr_hw.runtime.commands.numbers import above_zero
from lobstr_hw.runtime.stopping import StopRequest

__all__ = ["main"]

EXAMPLES = """examples:
  lobstr-bench lighthouse                      a made-up room with three trackers
  lobstr-bench lighthouse take.pcap.gz         and a recording
"""
STOPPED = "stopped; what was measured stands above."


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    options = _parser().parse_args(argv)
    return ended(
        lambda stop: _lighthouse(options, stop),
        _tell,
        as_json=options.json,
        stopped=STOPPED,
        stopped_document={"stopped": True},
    )


def _tell(message: str) -> None:
    print(f"lobstr-bench: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-bench",
        description="Measure how fast this machine does the work.",
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    lighthouse = commands.add_parser(
        "lighthouse",
        help="decoding and tracking of Lighthouse devices",
        description="Events (IMU samples, pulses, syncs, sweeps) decoded and tracked per second, "
        "in recordings and in a made-up room, and the share of one core that three trackers with "
        "two base stations take in real time. Other programs on the machine slow it down: the "
        "yardstick, a fixed piece of numpy work, is timed between the runs.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = lighthouse.add_argument
    add("files", type=Path, nargs="*", metavar="FILE", help="recordings, as lobstr-log import's")
    add("--stations", type=Path, metavar="FILE", help="where their base stations stand")
    add("--seconds", type=above_zero, default=10.0, metavar="S", help="of the made room (10)")
    add("--json", action="store_true", help="the outcome on stdout, as one JSON document")
    return parser


def _lighthouse(options: argparse.Namespace, stop: StopRequest) -> int:
    from lobstr_hw.drivers.vendor import require_library

    require_library("scipy", "scipy", "lighthouse")
    from lobstr_hw.runtime.commands import bench_lighthouse as bench

    progress = sys.stderr if options.json else sys.stdout
    print(bench.HEAD, file=progress)
    rows = []
    for row in bench.measure(options.files, options.stations, options.seconds):
        rows.append(row)
        print(row.line(), file=progress, flush=True)
        if stop():
            raise KeyboardInterrupt
    live = bench.measure_live(options.seconds)
    if stop():
        raise KeyboardInterrupt
    print(live.line(), file=progress)
    if options.json:
        print(json.dumps({"runs": [row.document() for row in rows], "live": live.document()}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
