"""``lobstr-devices``: what is plugged in, and what is missing for the rest."""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import asdict

from rich.console import Console
from rich.live import Live

from lobstr_hw.drivers import DRIVERS, split_driver_spec
from lobstr_hw.runtime.clock import Clock, HostClock
from lobstr_hw.runtime.commands.devices_table import page
from lobstr_hw.runtime.device_watch import ANSWER_S, DeviceWatch, DriverReport, merged
from lobstr_hw.runtime.sources import driver_from_spec
from lobstr_hw.runtime.stopping import StopRequest
from lobstr_hw.runtime.udev_rules import install_udev_rules

__all__ = ["main"]

STEP_S = 0.05
REFRESH_S = 0.5
CLOSING_S = 1.0

EXAMPLES = """examples:
  lobstr-devices
  lobstr-devices --watch
  lobstr-devices --driver polhemus:port=/dev/ttyUSB0 --json
  lobstr-devices --install-udev-rules
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    args = _parser().parse_args(argv)
    if args.install_udev_rules:
        return install_udev_rules(_tell)
    clock = HostClock()
    watches = [DeviceWatch(spec, asked, clock, _tell) for spec, asked in _specs(args.driver)]
    with StopRequest() as stop:
        for watch in watches:
            watch.start()
        try:
            _wait(watches, stop, clock)
            if args.watch:
                _draw(watches, stop, clock, Console(stderr=args.json))
        finally:
            _close(watches)
    reports = merged(watches)
    if args.json:
        print(json.dumps([asdict(report) for report in reports], indent=2))
    elif not args.watch:
        Console().print(page(reports))
    return 0


def _tell(message: str) -> None:
    print(f"lobstr-devices: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-devices",
        description="List every device of every driver; where something is missing, say what "
        "mends it.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add(
        "--driver",
        action="append",
        default=[],
        type=_spec,
        metavar="NAME[:k=v,...]",
        help="look at this one too: serial ports and files are opened only when named",
    )
    add("--watch", action="store_true", help="go on looking until Ctrl-C")
    add("--json", action="store_true", help="one object for each driver, as one JSON document")
    add(
        "--install-udev-rules",
        action="store_true",
        help="Linux: let whoever sits at this machine use USB devices; asks sudo, looks at none",
    )
    return parser


def _spec(text: str) -> str:
    try:
        driver_from_spec(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return text


def _specs(asked: Sequence[str]) -> list[tuple[str, bool]]:
    """What to look at: what the user named, and every other driver of the table."""
    named = {split_driver_spec(spec)[0] for spec in asked}
    specs = [(spec, True) for spec in asked]
    specs += [(name, False) for name in DRIVERS if name not in named]
    return sorted(specs, key=lambda spec: spec[0])


def _wait(watches: Sequence[DeviceWatch], stop: Callable[[], bool], clock: Clock) -> None:
    """Until all have answered, or long enough."""
    end_s = clock.now_s() + ANSWER_S
    while not (stop() or all(watch.settled.is_set() for watch in watches)):
        if clock.now_s() > end_s:
            break
        clock.sleep(STEP_S)
    for watch in watches:
        if not watch.settled.is_set() and not stop():
            _tell(f"the driver {watch.name} did not answer within {ANSWER_S:g} s; going on.")


def _draw(
    watches: Sequence[DeviceWatch], stop: Callable[[], bool], clock: Clock, console: Console
) -> None:
    """One page that is drawn anew; into a pipe or file, a page at every change."""
    with (
        Live(console=console, auto_refresh=False) if console.is_terminal else nullcontext() as live
    ):
        before: list[DriverReport] = []
        while not stop():
            now = merged(watches)
            if live is not None:
                live.update(page(now), refresh=True)
            elif now != before:
                console.print(page(now))
            before = now
            clock.sleep(REFRESH_S)


def _close(watches: Sequence[DeviceWatch]) -> None:
    for watch in watches:
        watch.stop()
    for watch in watches:
        if watch.settled.is_set():  # one that hangs is left behind
            watch.join(CLOSING_S)


if __name__ == "__main__":
    sys.exit(main())
