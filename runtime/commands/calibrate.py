"""``lobstr-calibrate``: the wizard, with a person and devices or on a log."""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from lobstr_hw.errors import ProfileError
from lobstr_hw.runtime.commands.ending import ended
from lobstr_hw.runtime.commands.numbers import above_zero, between
from lobstr_hw.runtime.profile_path import default_profile_path

if TYPE_CHECKING:
    from lobstr_hw.drivers.driver import TrackerDriver
    from lobstr_hw.runtime.wizard.stage import Person

__all__ = ["main"]

STATURES_CM = (100.0, 230.0)
CLEARANCES_CM = (0.0, 30.0)
LONGEST_COUNTDOWN_S = 60.0

EXAMPLES = """examples:
  lobstr-calibrate --driver openvr              with a person; spoken, for the headset is on
  lobstr-calibrate --driver openvr --floor --countdown 5 --height 176
  lobstr-calibrate --sim take.mcap --yes --profile me.json
  lobstr-calibrate --driver fake:script=calibrate    to see what it looks like
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    parser = _parser()
    args = parser.parse_args(argv)
    if args.sim is not None and args.driver:
        parser.error("--sim is a source of its own; leave --driver out")
    if args.sim is not None and (args.countdown or args.timeout is not None):
        parser.error("--countdown and --timeout are for people; a log waits for nobody")
    return ended(
        lambda stop: _run(args, stop),
        _tell,
        as_json=args.json,
        stopped="stopped; nothing was written.",
        stopped_code=0,
        stopped_document={"stopped": True},
    )


def _tell(message: str) -> None:
    print(f"lobstr-calibrate: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-calibrate",
        description="Ask for a T-pose, tell how the trackers sit and how big you are, keep it in a "
        "profile.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("--sim", type=Path, metavar="LOG", help="look for the T-pose in a tracker log")
    add("--driver", action="append", default=[], metavar="NAME[:k=v,...]", help="listen to devices")
    add("--profile", type=Path, metavar="FILE", help="where it goes (your configuration folder)")
    add(
        "--height",
        type=between(*STATURES_CM, "cm"),
        metavar="CM",
        help="your height; otherwise the headset tells",
    )
    add(
        "--floor",
        type=between(*CLEARANCES_CM, "cm"),
        nargs="?",
        const=3.0,
        metavar="CM",
        help="touch the floor with a controller first; CM from the floor to the controller's own "
        "origin when it does (3)",
    )
    add(
        "--countdown",
        type=between(0.0, LONGEST_COUNTDOWN_S, "s"),
        default=0.0,
        metavar="S",
        help="before every step (0)",
    )
    add("--timeout", type=above_zero, metavar="S", help="give up after so long")
    add("--no-speech", action="store_true", help="bells only")
    add("--yes", action="store_true", help="ask nothing; an old profile is replaced")
    add("--json", action="store_true", help="the result on stdout, as one JSON document")
    return parser


def _run(args: argparse.Namespace, stop: Callable[[], bool]) -> int:
    driver = _driver(args)
    if driver is None:
        return 2
    path = args.profile or default_profile_path()
    if path.exists() and not args.yes and not _may_replace(path):
        raise ProfileError(
            f"{path} is left as it was. --yes replaces it; or give another --profile FILE."
        )
    person = _wizard_on_log(args, driver, stop) if args.sim else _wizard(args, path, driver, stop)
    if person is None:
        raise KeyboardInterrupt
    _save(args, path, person)
    return 0


def _driver(args: argparse.Namespace) -> "TrackerDriver | None":
    from lobstr_hw.drivers.replay import ReplayDriver
    from lobstr_hw.runtime.sources import drivers_from_specs

    if args.sim is not None:
        return ReplayDriver(args.sim)
    try:
        return drivers_from_specs(args.driver, _tell)
    except ValueError as error:
        _tell(f"{error}")
        return None


def _may_replace(path: Path) -> bool:
    """Ask; without anybody to ask the answer is no."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    print(f"{path} exists. Replace it? [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _person(args: argparse.Namespace, unix_s: float | None) -> "Person":
    """Nothing is known but the height, and when this is (not every log says)."""
    from lobstr_hw.runtime.wizard.stage import Person

    when = "" if unix_s is None else datetime.fromtimestamp(unix_s, UTC).isoformat("T", "seconds")
    return Person(stature_m=None if args.height is None else args.height / 100.0, created=when)


def _clearance_m(args: argparse.Namespace) -> float | None:
    return None if args.floor is None else args.floor / 100.0


def _wizard_on_log(
    args: argparse.Namespace, driver: "TrackerDriver", stop: Callable[[], bool]
) -> "Person | None":
    """What a log gives; None when stopped.

    Raises:
        LogFileError: the log cannot be read.
        MissingRole, TPoseNotFound: what was seen, and what to do.
    """
    from lobstr_hw.calibration import TrackingSpace
    from lobstr_hw.drivers.replay import ReplayDriver
    from lobstr_hw.runtime.one_space import spaces_apart
    from lobstr_hw.runtime.profiles import spaces_as_before
    from lobstr_hw.runtime.wizard.flow import Wizard
    from lobstr_hw.runtime.wizard.plan import steps_for_a_log, steps_to_join
    from lobstr_hw.runtime.wizard.run import run_on_log

    assert isinstance(driver, ReplayDriver)
    with driver:
        damage = driver.log.damage
        if damage:
            _tell(f"{args.sim}: {damage}; looking at the {driver.duration_s:.1f} s before.")
        world = spaces_apart(driver)
        if world is not None:
            world.join_as_before(spaces_as_before(driver, world.name))
        steps = steps_to_join(world) + steps_for_a_log(floor_clearance_m=_clearance_m(args))
        wizard = Wizard(_person(args, driver.log.unix_offset_s), steps)
        run_on_log(driver, wizard, stop, world)
        wizard.person.spaces = {"replay": TrackingSpace()} if world is None else world.spaces
    return wizard.person if wizard.done else None


def _wizard(
    args: argparse.Namespace, path: Path, driver: "TrackerDriver", stop: Callable[[], bool]
) -> "Person | None":
    """What a person does; None when stopped."""
    from lobstr_hw.calibration import TrackingSpace
    from lobstr_hw.runtime.clock import HostClock
    from lobstr_hw.runtime.one_space import spaces_apart
    from lobstr_hw.runtime.profiles import spaces_as_before
    from lobstr_hw.runtime.sources import space_name
    from lobstr_hw.runtime.wizard.flow import Wizard
    from lobstr_hw.runtime.wizard.front import PersonFront
    from lobstr_hw.runtime.wizard.plan import steps_for_a_person, steps_to_join
    from lobstr_hw.runtime.wizard.result import spoken_result
    from lobstr_hw.runtime.wizard.run import run_with_person

    clock = HostClock()
    front = PersonFront(speech=not args.no_speech, terminal=sys.stderr.isatty(), tell=_tell)
    with driver, front:
        world = spaces_apart(driver)
        before = {} if world is None else spaces_as_before(path, world.name)
        steps = steps_to_join(world, before)
        steps += steps_for_a_person(floor_clearance_m=_clearance_m(args), confirm=not args.yes)
        wizard = Wizard(_person(args, clock.unix_s()), steps, countdown_s=args.countdown)
        run_with_person(world or driver, wizard, front, clock, stop, args.timeout)
        names = [space_name(spec) for spec in args.driver[:1]]
        alone = {name: TrackingSpace() for name in names}
        wizard.person.spaces = alone if world is None else world.spaces
        if wizard.done:
            front.say([spoken_result(wizard.person)])
            front.show(wizard.view())
    return wizard.person if wizard.done else None


def _save(args: argparse.Namespace, path: Path, person: "Person") -> None:
    from lobstr_hw.calibration import save_profile
    from lobstr_hw.runtime.wizard.result import document, show

    assert person.calibration is not None
    person.calibration = replace(person.calibration, tracking_spaces=person.spaces)
    save_profile(path, person.calibration)
    if args.json:
        print(json.dumps(document(person, path)))
    else:
        show(person, path)


if __name__ == "__main__":
    sys.exit(main())
