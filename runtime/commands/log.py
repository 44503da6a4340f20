"""``lobstr-log``: make tracker logs, look into them, bring them into other forms, mend them."""

import argparse
import contextlib
import json
import os
import signal
import sys
from collections.abc import Iterator, Sequence

from lobstr_hw.errors import LobstrError
from lobstr_hw.runtime.commands import log_export, log_import, log_info, log_make, log_repair
from lobstr_hw.runtime.commands.log_report import Report

__all__ = ["main"]

COMMANDS = (log_make, log_info, log_export, log_import, log_repair)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one subcommand.

    Returns:
        The exit code: 0 done or stopped by the user, 1 failed; wrong use leaves with 2.
    """
    options = _parser().parse_args(arguments)
    try:
        with _stop_signals_interrupt():
            report: Report = options.run(options)
    except (LobstrError, OSError) as error:
        print(f"lobstr-log {options.command}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"lobstr-log {options.command}: stopped; nothing was written", file=sys.stderr)
        return 0
    _say(json.dumps(report.document) if options.json else report.text)
    return 0


def _say(text: str) -> None:
    try:
        print(text, flush=True)
    except BrokenPipeError:  # the reader (head, less) has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-log",
        description="Make tracker logs, look into them, export and repair them.",
        epilog="example: lobstr-log make walk.bvh walk.mcap --height 172 --seed 7",
    )
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in COMMANDS:
        added = command.add_parser(subparsers)
        added.set_defaults(run=command.run)
        added.add_argument(
            "--json", action="store_true", help="one JSON document on stdout, all else on stderr"
        )
    return parser


@contextlib.contextmanager
def _stop_signals_interrupt() -> Iterator[None]:
    """SIGTERM and Ctrl-Break do what Ctrl-C does."""
    numbers = [getattr(signal, n) for n in ("SIGTERM", "SIGBREAK") if hasattr(signal, n)]
    before = {number: signal.signal(number, signal.default_int_handler) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


if __name__ == "__main__":
    sys.exit(main())
