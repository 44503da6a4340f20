"""``lobstr-log repair``: a whole log from one that was cut."""

import argparse
from pathlib import Path

from lobstr_hw.drivers.tracker_log import repair_log
from lobstr_hw.runtime.commands.log_report import Report, Subparsers, progress_bar, whole_file

__all__ = ["add_parser", "run"]


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """The options of ``repair``."""
    parser = subparsers.add_parser(
        "repair",
        help="a whole log from a cut one",
        description="Keep every whole message of a log that was cut, compressed and with an index.",
        epilog="example: lobstr-log repair cut.mcap whole.mcap",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="the cut log; it stays as it is")
    parser.add_argument("out", type=Path, metavar="OUT", help="the whole log")
    return parser


def run(options: argparse.Namespace) -> Report:
    """Mend the log."""
    with progress_bar("copying messages") as step:
        with whole_file(options.out) as part:
            repaired = repair_log(options.file, part, step)
    document = {
        "file": str(options.out),
        "messages": repaired.messages,
        "damage": repaired.damage or None,
    }
    before = repaired.damage or "the log was whole"
    text = f"{options.out}: {repaired.messages} messages kept ({before})"
    return Report(text, document)
