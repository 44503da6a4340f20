"""USB captures of Lighthouse devices, presented to the real hidapi and pyusb by a test bed.

    python tools/lighthouse_usb.py CAPTURES [--only NAME] [--hits] [--write docs/results.md]

CAPTURES holds NAME.pcap.gz (usbmon) and NAME.pcap.gz.usbdevs. Each device of a capture is plugged
into umockdev (apt-get install umockdev gir1.2-umockdev-1.0 python3-gi libusb-1.0-0), opened, asked
for its configuration and read by each transport. What was read is held against the file, byte for
byte, and so are the poses that follow from it (--hits: only the hits of sensors, much sooner).
"""

import argparse
import datetime
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from results_page import write_section
from usb_comparison import compare, reports_of_device, takes_and_stations

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.captured_usb import devices_of_capture, usb_identities
from support.lighthouse_bed import RemoteBed, use_system_libusb
from support.scripted_usb import ScriptedDevice, load_script, save_script
from support.umockdev_beds import SUPPORT, SYSTEM_PYTHON

from lobstr_hw.drivers.lighthouse.device_commands import download_config
from lobstr_hw.drivers.lighthouse.device_config import inflate_config, join_pieces
from lobstr_hw.drivers.lighthouse.transport import (
    NoAnswer,
    OpenDevice,
    Transport,
    UsbDeviceInfo,
)
from lobstr_hw.drivers.lighthouse.transports import TRANSPORTS
from lobstr_hw.errors import FileFormatError

HEADING = "## Lighthouse through the USB libraries"
INSIDE = "inside"
SLICE_S = 0.005
"""Reports of so long a time are under way at once, and may overtake those of other interfaces."""
BATCH = 16
"""No more than these of one device: hidapi keeps 30."""
PATIENCE_S = 60.0


@dataclass(frozen=True, slots=True)
class DeviceRead:
    """One device, read by one transport.

    Attributes:
        transport: its name.
        address: of the device on the capture's bus.
        reports: in the file.
        equal: of them, those that came, byte for byte and in the order of their interface.
        config: its configuration came as it is in the file; None: the file has none.
        order: the interface of each report, in the order in which they were handed out.
        seconds: that it took.
    """

    transport: str
    address: int
    reports: int
    equal: int
    config: bool | None
    order: str
    seconds: float


def read_capture(
    bed: RemoteBed, transport: Transport, script: Sequence[ScriptedDevice]
) -> list[DeviceRead]:
    """Read all devices of the bed at once, to their end."""
    by_serial = _listed(transport, {device.serial for device in script})
    opened = [transport.open(by_serial[device.serial]) for device in script]
    try:
        configs = [_config_is_right(o, device) for o, device in zip(opened, script, strict=True)]
        begin_s = time.perf_counter()
        came = _read_all(bed, opened, script)
        seconds = time.perf_counter() - begin_s
    finally:
        for one in opened:
            one.close()
    return [
        DeviceRead(
            transport.name, device.address, len(device.reports), _equal(device, reports), config,
            "".join(str(interface) for interface, _ in reports), seconds,
        )
        for device, config, reports in zip(script, configs, came, strict=True)
    ]  # fmt: skip


def _listed(transport: Transport, serials: set[str]) -> dict[str, UsbDeviceInfo]:
    """What is listed, once libusb has heard of what was plugged in and out."""
    for _ in range(1000):
        found = {info.serial: info for info in transport.enumerate()}
        if set(found) == serials:
            return found
        time.sleep(0.02)
    raise SystemExit(f"{transport.name} lists {sorted(found)} instead of {sorted(serials)}")


def _config_is_right(opened: OpenDevice, device: ScriptedDevice) -> bool | None:
    try:
        expected = inflate_config(join_pieces(device.features.get(0x11, [])))
    except FileFormatError:
        try:
            download_config(opened)
        except NoAnswer:
            return None
        return False
    return download_config(opened) == expected


def _read_all(
    bed: RemoteBed, opened: Sequence[OpenDevice], script: Sequence[ScriptedDevice]
) -> list[list[tuple[int, bytes]]]:
    came: list[list[tuple[int, bytes]]] = [[] for _ in script]
    for counts in _slices(script):
        for number, count in counts.items():
            bed.play(count, number)
        for number, count in counts.items():
            for _ in range(count):
                report = opened[number].read(PATIENCE_S)
                if report is None:
                    return came
                came[number].append((report.interface, report.data))
    return came


def _slices(script: Sequence[ScriptedDevice]) -> Iterator[dict[int, int]]:
    """How many reports of each device are under way at once."""
    ahead = sorted((t, number) for number, d in enumerate(script) for t, _, _ in d.reports)
    begin_s, counts = 0.0, Counter[int]()
    for time_s, number in ahead:
        if time_s - begin_s > SLICE_S or counts[number] >= BATCH:
            yield counts
            begin_s, counts = time_s, Counter()
        counts[number] += 1
    yield counts


def _equal(device: ScriptedDevice, came: Sequence[tuple[int, bytes]]) -> int:
    """How many reports are as in the file; up to the first that is not, by interface."""
    equal = 0
    for interface in range(len(device.ends)):
        expected = [data for _, i, data in device.reports if i == interface]
        got = [data for i, data in came if i == interface]
        same = [a == b for a, b in zip(expected, got, strict=False)]
        equal += same.index(False) if False in same else len(same)
    return equal


@dataclass(frozen=True, slots=True)
class CaptureRow:
    """One capture.

    Attributes:
        name: of the file.
        reads: what came of its devices.
        solved: its stations are known, so ``found`` counts tracked poses, and hits otherwise.
        found: by the file.
        only: those that follow from the file or from the reports as they were handed out only.
        apart: the largest difference of those that follow from both.
    """

    name: str
    reads: list[DeviceRead]
    solved: bool
    found: int
    only: int
    apart: float


def measure(path: Path, transports: Sequence[str], solve: bool) -> CaptureRow:
    """Present a capture to the transports."""
    with tempfile.TemporaryDirectory() as folder:
        script, answer = Path(folder) / "script.json", Path(folder) / "answer.json"
        save_script(devices_of_capture(path), script)
        command = [sys.executable, __file__, INSIDE, str(script), str(answer), *transports]
        bed = [str(SYSTEM_PYTHON), str(SUPPORT / "lighthouse_testbed.py"), str(script)]
        subprocess.run([*bed, *command], check=True)
        reads = [DeviceRead(**read) for read in json.loads(answer.read_text(encoding="utf-8"))]
    takes, stations = takes_and_stations(path, solve)
    ends = {address: ends for _, _, address, ends in usb_identities(path)}
    found, only, apart = 0, 0, 0.0
    for take in takes:
        address = int(take.recording.name.split(".")[1])
        reports = reports_of_device(path, address)
        orders = {r.order for r in reads if r.address == address and r.equal == r.reports}
        counts = [compare(take, stations, reports, order, ends[address]) for order in orders]
        found += max((count for count, _, _ in counts), default=0)
        only += max((unlike for _, unlike, _ in counts), default=0)
        apart = max([apart, *(difference for _, _, difference in counts)])
    return CaptureRow(path.name.split(".")[0], reads, bool(stations), found, only, apart)


def inside(script: Path, answer: Path, transports: Sequence[str]) -> None:
    """Within the bed: read everything by each transport, and write down what came."""
    devices = load_script(script)
    use_system_libusb()
    bed = RemoteBed()
    reads = []
    for transport in [t for t in TRANSPORTS if t.name in transports]:
        reads += read_capture(bed, transport, devices)
        for number in range(len(devices)):
            bed.unplug(number)
            bed.plug(number)
    bed.close()
    answer.write_text(json.dumps([asdict(read) for read in reads]), encoding="utf-8")


TEXT = """{heading}

`python tools/lighthouse_usb.py CAPTURES` on {date}. umockdev presents each device of a capture to
the real library. A report counts when it came byte for byte and in the order of its interface.
Found: tracked poses, where the stations were solved from the capture, or else hits of its sensors.
Beside stand those from the reports in the order in which a library handed them out, interfaces
mixed: how many there are in one order only, and the largest difference of the others (metres,
radians, elements of rotations). In WM1-wand the bus of the recording's machine was held up, and
light came up to 0.2 s after the IMU samples of its time; tracking waits 30 ms for it, so there it
is chance which light is still used.

| capture | devices | reports | {transports} | configurations | found | one order | difference |
|---|---|---|{lines}---|---|---|---|
{rows}
"""


def table(rows: Sequence[CaptureRow], transports: Sequence[str]) -> str:
    """The section of the results page."""
    return TEXT.format(
        heading=HEADING,
        date=datetime.date.today(),
        transports=" | ".join(transports),
        lines="---|" * len(transports),
        rows="\n".join(_line(row, transports) for row in rows),
    )


def _line(row: CaptureRow, transports: Sequence[str]) -> str:
    first = [read for read in row.reads if read.transport == transports[0]]
    cells = [row.name, f"{len(first)}", f"{sum(read.reports for read in first):,}"]
    for name in transports:
        of_it = [read for read in row.reads if read.transport == name]
        share = sum(r.equal for r in of_it) / max(sum(r.reports for r in of_it), 1)
        cells.append(f"{100 * share:.2f} %")
    told = [read.config for read in row.reads if read.config is not None]
    cells.append(f"{sum(told)} of {len(told)}")
    cells += [
        f"{row.found:,} {'poses' if row.solved else 'hits'}",
        f"{row.only}",
        f"{row.apart:.2g}",
    ]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    if sys.argv[1:2] == [INSIDE]:
        inside(Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4:])
        return
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("captures", type=Path)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--transport", action="append", default=[])
    parser.add_argument("--hits", action="store_true")
    parser.add_argument("--write", type=Path)
    args = parser.parse_args()
    transports = args.transport or [t.name for t in TRANSPORTS]
    rows = []
    for path in sorted(args.captures.glob("*.pcap.gz")):
        if not args.only or path.name.split(".")[0] in args.only:
            rows.append(measure(path, transports, not args.hits))
            print(_line(rows[-1], transports), flush=True)
            if args.write:
                write_section(table(rows, transports), args.write)


if __name__ == "__main__":
    main()
