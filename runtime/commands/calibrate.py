"""``lobstr-calibrate``: from a T-pose to a profile."""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lobstr_hw.errors import DriverUnavailable, LobstrError, ProfileError
from lobstr_hw.runtime.profile_path import default_profile_path
from lobstr_hw.runtime.stopping import StopRequest

if TYPE_CHECKING:
    from lobstr_hw.calibration import Calibration, TPose

__all__ = ["main"]

STATURES_CM = (100.0, 230.0)
_POLL_S = 0.1

EXAMPLES = """example:
  lobstr-calibrate --sim take.mcap --yes --profile me.json
  lobstr-live --sim take.mcap --profile me.json
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    args = _parser().parse_args(argv)
    try:
        with StopRequest() as stop:  # before the slow imports, so that Ctrl-C is clean from here on
            return _run(args, stop)
    except LobstrError as error:
        _tell(str(error))
        if args.json:
            print(json.dumps({"error": str(error)}))
        return 1
    except KeyboardInterrupt:
        _tell("stopped; nothing was written.")
        if args.json:
            print(json.dumps({"stopped": True}))
        return 0


def _tell(message: str) -> None:
    print(f"lobstr-calibrate: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-calibrate",
        description="Find a T-pose, tell how the trackers sit and how big you are, keep it in a "
        "profile.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("--sim", type=Path, metavar="LOG", help="look for the T-pose in a tracker log")
    add("--profile", type=Path, metavar="FILE", help="where it goes (your configuration folder)")
    add("--height", type=_stature, metavar="CM", help="your height; otherwise the headset tells")
    add("--yes", action="store_true", help="ask nothing; an old profile is replaced")
    add("--json", action="store_true", help="the result on stdout, as one JSON document")
    return parser


def _stature(text: str) -> float:
    low, high = STATURES_CM
    value = float(text)
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(f"{text} cm is not between {low:g} and {high:g}")
    return value


def _run(args: argparse.Namespace, stop: Callable[[], bool]) -> int:
    if args.sim is None:
        raise DriverUnavailable(
            "calibrating with devices comes with the hardware drivers, which are not in this "
            "version. Calibrate from a log: lobstr-calibrate --sim LOG"
        )
    path = args.profile or default_profile_path()
    if path.exists() and not args.yes and not _may_replace(path):
        raise ProfileError(
            f"{path} is left as it was. --yes replaces it; or give another --profile FILE."
        )
    pose = _t_pose(args.sim, stop)
    if pose is None:
        raise KeyboardInterrupt
    calibration = _calibrated(pose, args.height)
    from lobstr_hw.calibration import save_profile

    save_profile(path, calibration)
    if args.json:
        print(json.dumps(_document(pose, calibration, path)))
    else:
        _show(pose, calibration, path)
    return 0


def _may_replace(path: Path) -> bool:
    """Ask; without anybody to ask the answer is no."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    print(f"{path} exists. Replace it? [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _t_pose(log: Path, stop: Callable[[], bool]) -> "TPose | None":
    """The first T-pose of a log; None when stopped.

    Raises:
        LogFileError: the log cannot be read.
        MissingRole, TPoseNotFound: what was seen, and what to do.
    """
    from lobstr_hw.calibration import TPoseDetector
    from lobstr_hw.drivers.replay import ReplayDriver

    with ReplayDriver(log) as driver:
        if driver.log.damage:
            _tell(f"{log}: {driver.log.damage}; looking at the {driver.duration_s:.1f} s before.")
        hints = {device.serial: device.role_hint for device in driver.devices()}
        detector = TPoseDetector({serial: role for serial, role in hints.items() if role})
        step = 0
        while not stop():
            found = detector.add(driver.poll(step * _POLL_S))
            if found is not None:
                return found
            if driver.finished(step * _POLL_S):
                raise detector.failure()
            step += 1
    return None


def _calibrated(pose: "TPose", height_cm: float | None) -> "Calibration":
    from lobstr_hw.calibration import calibrate_t_pose
    from lobstr_hw.poses import Pose

    calibration = calibrate_t_pose(
        pose,
        stature_m=None if height_cm is None else height_cm / 100.0,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    return replace(calibration, tracking_spaces={"replay": Pose.identity()})


def _document(pose: "TPose", calibration: "Calibration", path: Path) -> dict[str, Any]:
    from lobstr_hw.calibration.verdict import verdict

    return {
        "profile": str(path),
        "verdict": str(verdict(calibration.residuals)),
        "t_pose_s": [pose.start_s, pose.end_s],
        "stature_m": calibration.stature_m,
        "hips_height_m": 1.0 / calibration.scale,
        "scale": calibration.scale,
        "arm_m": calibration.arm_m,
        "heading_rad": calibration.heading_rad,
        "floor_height_m": calibration.floor_m,
        "trackers": {serial: str(role) for serial, role in calibration.roles.items()},
        "residuals": asdict(calibration.residuals),
    }


def _show(pose: "TPose", calibration: "Calibration", path: Path) -> None:
    from rich.console import Console

    from lobstr_hw.runtime.commands.calibrate_tables import closing_words, tables

    console = Console()
    for table in tables(pose, calibration):
        console.print(table)
    for line in closing_words(calibration, path):
        console.print(line, soft_wrap=True, highlight=False, markup=False)


if __name__ == "__main__":
    sys.exit(main())
