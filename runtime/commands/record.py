"""``lobstr-record``: a tracker log of whatever is plugged in."""

import argparse
import json
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lobstr_hw.errors import OutputError
from lobstr_hw.runtime.commands.ending import ended
from lobstr_hw.runtime.commands.numbers import above_zero, between
from lobstr_hw.runtime.stopping import StopRequest

if TYPE_CHECKING:
    from lobstr_hw.calibration import Calibration
    from lobstr_hw.drivers.driver import TrackerDriver
    from lobstr_hw.drivers.tracker_log import TrackerLogWriter
    from lobstr_hw.runtime.clock import HostClock
    from lobstr_hw.runtime.recording import Recorder
    from lobstr_hw.runtime.recording_status import RecordingSnapshot

__all__ = ["main"]

RATES_HZ = (1.0, 1000.0)

EXAMPLES = """examples:
  lobstr-record take.mcap                               until Ctrl-C
  lobstr-record take.mcap --driver fake --duration 20
  lobstr-record take.mcap --driver openvr --driver polhemus:port=/dev/ttyUSB0,role=pelvis
  lobstr-record take.mcap --driver lighthouse --raw take.pcap
  lobstr-live --sim take.mcap                           play it again
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    args = _parser().parse_args(argv)
    at_once = f"stopped at once; {args.out} is as it was left. See: lobstr-log info {args.out}"
    return ended(lambda stop: _run(args, stop), _tell, as_json=args.json, stopped=at_once)


def _tell(message: str) -> None:
    print(f"lobstr-record: {message}", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-record",
        description="Record trackers as their drivers give them, until Ctrl-C. A log that is cut "
        "by a crash can be read as far as it goes.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("out", type=Path, metavar="OUT.mcap", help="the log to write")
    add("--driver", action="append", default=[], metavar="NAME[:k=v,...]", help="listen to devices")
    add("--profile", type=Path, metavar="FILE", help="names the trackers, and goes into the log")
    add("--duration", type=above_zero, metavar="S", help="seconds to record")
    add(
        "--rate",
        type=between(*RATES_HZ, "Hz"),
        default=90.0,
        metavar="HZ",
        help="how often devices are asked (90)",
    )
    add(
        "--raw",
        type=Path,
        metavar="FILE",
        help="beside the log, all that the driver lighthouse reads from USB; lobstr-log import "
        "tracks it anew",
    )
    add("--force", action="store_true", help="replace a file that is there")
    add("--quiet", action="store_true", help="no status lines and no closing words")
    add("--json", action="store_true", help="the outcome on stdout, as one JSON document")
    return parser


def _run(args: argparse.Namespace, stop: StopRequest) -> int:
    from lobstr_hw.calibration import load_profile
    from lobstr_hw.runtime.sources import drivers_from_specs

    for path in filter(None, (args.out, args.raw)):
        if path.exists() and not args.force:
            raise OutputError(f"{path} exists. Choose another name, or replace it with --force.")
    try:
        driver = drivers_from_specs(_specs(args.driver, args.raw), _tell)
    except ValueError as error:
        _tell(f"{error}")
        return 2
    profile = None if args.profile is None else load_profile(args.profile)
    with driver:  # before the file, so that a missing device costs no old recording
        return _record(args, driver, profile, stop)


def _specs(specs: Sequence[str], raw: Path | None) -> Sequence[str]:
    """The drivers, the one that can be told to write down its raw reports.

    Raises:
        ValueError: none of them can.
    """
    from lobstr_hw.drivers import with_option

    if raw is None:
        return specs
    specs = list(specs) or ["lighthouse"]
    for k, spec in enumerate(specs):
        with_raw = with_option(spec, "raw", raw)
        if with_raw == spec:
            raise ValueError(f"{spec} has raw= already: leave that or --raw out")
        if with_raw is not None:
            specs[k] = with_raw
            return specs
    raise ValueError("--raw is what goes over USB: it needs --driver lighthouse")


def _record(
    args: argparse.Namespace,
    driver: "TrackerDriver",
    profile: "Calibration | None",
    stop: StopRequest,
) -> int:
    from lobstr_hw.calibration.profile import profile_to_json
    from lobstr_hw.drivers.tracker_log import TrackerLogWriter
    from lobstr_hw.runtime.clock import HostClock
    from lobstr_hw.runtime.live_line import LiveLine
    from lobstr_hw.runtime.recording import Recorder
    from lobstr_hw.runtime.recording_status import render_recording
    from lobstr_hw.runtime.roles import RoleTable

    clock = HostClock()
    writer = TrackerLogWriter(args.out)
    table = RoleTable(None if profile is None else profile.roles, driver.devices)
    recorder = Recorder(driver, writer, table, clock, args.rate, _tell)
    trouble = ""
    try:
        if profile is not None:
            writer.attach_profile(profile_to_json(profile).encode())
        with LiveLine(lambda: _snapshot(recorder, clock, args.out), render_recording, args.quiet):
            recorder.run(stop, args.duration)
    except OSError as error:
        trouble = f"{error.strerror or error}"
        writer.abandon()
    except BaseException:  # a second Ctrl-C, or a fault of a driver
        writer.abandon()
        raise
    return _finish(args, recorder, writer, trouble, stop)


def _snapshot(recorder: "Recorder", clock: "HostClock", path: Path) -> "RecordingSnapshot":
    from lobstr_hw.runtime.recording_status import RecordingSnapshot, TrackerLine

    lines = [
        TrackerLine(serial, t.role, t.samples, t.dropouts, t.newest is None or t.newest.tracked)
        for serial, t in list(recorder.trackers.items())
    ]
    free = shutil.disk_usage(path.resolve().parent).free
    bytes_ = path.stat().st_size
    now_s = clock.now_s()
    return RecordingSnapshot(recorder.elapsed_s, now_s, bytes_, free, recorder.late, tuple(lines))


def _finish(
    args: argparse.Namespace,
    recorder: "Recorder",
    writer: "TrackerLogWriter",
    trouble: str,
    stop: StopRequest,
) -> int:
    """Close the log, say how it went; returns the exit code."""
    if not trouble:
        try:
            writer.close()
        except OSError as error:
            trouble = f"{error.strerror or error}"
            writer.abandon()
    if not recorder.trackers:
        args.out.unlink()
        _tell("no tracker gave a sample; nothing was kept. See what is there: lobstr-devices")
    elif trouble:
        _tell(
            f"writing to {args.out} failed ({trouble}); what was written until then is there. "
            f"Free some space, then: lobstr-log repair {args.out} OUT.mcap"
        )
    elif not args.quiet:
        _tell(_closing_words(args, recorder))
    if args.json:
        print(json.dumps(_document(args, recorder, trouble)))
    return 1 if trouble or not (recorder.trackers or stop.asked) else 0


def _closing_words(args: argparse.Namespace, recorder: "Recorder") -> str:
    from lobstr_hw.runtime.recording_status import size

    dropouts = sum(tally.dropouts for tally in recorder.trackers.values())
    return (
        f"{args.out}: {recorder.elapsed_s:.1f} s of {len(recorder.trackers)} trackers, "
        f"{size(args.out.stat().st_size)}, {dropouts} drop-outs. "
        f"Play it: lobstr-live --sim {args.out}"
    )


def _document(args: argparse.Namespace, recorder: "Recorder", trouble: str) -> dict[str, Any]:
    document: dict[str, Any] = {
        "file": str(args.out) if recorder.trackers else None,
        "duration_s": round(recorder.elapsed_s, 3),
        "bytes": args.out.stat().st_size if recorder.trackers else 0,
        "late": recorder.late,
        "trackers": [
            {
                "serial": serial,
                "role": tally.role,
                "samples": tally.samples,
                "dropouts": tally.dropouts,
                "lost_s": round(tally.lost_s, 3),
                "battery": tally.battery,
            }
            for serial, tally in recorder.trackers.items()
        ],
    }
    return document | ({"error": trouble} if trouble else {})


if __name__ == "__main__":
    sys.exit(main())
