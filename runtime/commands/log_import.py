"""``lobstr-log import``: a tracker log from recordings in another form."""

import argparse
from pathlib import Path

from lobstr_hw.drivers.vendor import require_library
from lobstr_hw.errors import FileFormatError
from lobstr_hw.runtime.commands.log_export import CSV_COLUMNS
from lobstr_hw.runtime.commands.log_import_csv import import_csv
from lobstr_hw.runtime.commands.log_report import Report, Step, Subparsers, progress_bar
from lobstr_hw.runtime.commands.recording_kind import RecordingKind, recording_kind

__all__ = ["add_parser", "run"]

EXAMPLES = """examples:
  lobstr-log import take.csv.gz take.mcap
  lobstr-log import room.pcap.gz --output room.mcap --save-stations room.json
  lobstr-log import still.pcapng --output still.mcap --stations room.json --config wand.json
"""


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """The options of ``import``."""
    parser = subparsers.add_parser(
        "import",
        help="a log from Lighthouse recordings, or from the CSV that export writes",
        description="Make a log from what was recorded elsewhere; .gz as it is. The kind of a file "
        "is told from its content: USB traffic of Lighthouse devices (usbmon, USBPcap, and what "
        "lobstr-record --raw writes), a text recording of libsurvive, or a CSV as export --csv "
        "writes it. Where the base stations stand is worked out from the light in the recordings.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("files", type=Path, metavar="FILE", nargs="+", help="the recordings, of one room")
    add("--output", type=Path, metavar="LOG.mcap", help="the log to write (else the last FILE)")
    add("--stations", type=Path, metavar="FILE", help="where the base stations stand")
    add("--save-stations", type=Path, metavar="FILE", help="keep where they stand")
    add(
        "--config",
        type=Path,
        metavar="FILE",
        help="configuration of a device that was already in use when the recording began: its "
        "JSON, or a recording that has it",
    )
    return parser


def run(options: argparse.Namespace) -> Report:
    """Write the log."""
    files, out = _sources_and_log(options)
    kinds = {path: recording_kind(path) for path in files}
    for path, kind in kinds.items():
        if kind is RecordingKind.UNKNOWN or (kind is RecordingKind.CSV and len(files) > 1):
            raise FileFormatError(_what_is_known(path, kind))
    with progress_bar("reading") as step:
        if kinds[files[0]] is RecordingKind.CSV:
            return import_csv(files[0], out, step)
        return _lighthouse(files, out, options, step)


def _sources_and_log(options: argparse.Namespace) -> tuple[list[Path], Path]:
    """What to read, what to write; the last FILE is the log only where it cannot be a recording."""
    if options.output:
        return options.files, options.output
    *files, out = options.files
    if not files:
        raise FileFormatError(f"which log should {out} become? Name it with --output LOG.mcap.")
    is_recording = out.exists() and recording_kind(out) is not RecordingKind.UNKNOWN
    if is_recording or out.suffix != ".mcap":
        raise FileFormatError(
            f"{out} is the last FILE, which would become the log, but it "
            f"{'is a recording' if is_recording else 'does not end in .mcap'}. "
            "Name the log with --output LOG.mcap."
        )
    return files, out


def _lighthouse(files: list[Path], out: Path, options: argparse.Namespace, step: Step) -> Report:
    require_library("scipy", "scipy", "lighthouse")
    from lobstr_hw.runtime.commands.log_import_lighthouse import import_recordings

    known = (options.config, options.stations, options.save_stations)
    return import_recordings(files, out, *known, step)


def _what_is_known(path: Path, kind: RecordingKind) -> str:
    if kind is RecordingKind.CSV:
        return f"{path} is a CSV, of which one makes a log: import it alone."
    return (
        f"{path} is not a recording that can be imported. Known is the CSV of lobstr-log export, "
        f"which begins with {','.join(CSV_COLUMNS)}; and of Lighthouse devices a usbmon or USBPcap "
        "capture and libsurvive's text recording, any of them packed with gzip or not."
    )
