"""Decode USB captures of Lighthouse devices and hold them against reference decodings.

    python tools/lighthouse_decode.py CAPTURES DECODED [--write docs/results.md]

CAPTURES holds NAME.pcap.gz (usbmon), DECODED holds NAME.npz with DEVICE_imu, _pulse, _sync, _sweep,
_angle1 and _angle2 by the reference decoder. A device of the file is the capture's device that
shares most of its IMU samples.
"""

import argparse
import datetime
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from results_page import write_section

from lobstr_hw.drivers.lighthouse.angles import Ints
from lobstr_hw.drivers.lighthouse.captured_device import CapturedDevice, read_devices
from lobstr_hw.drivers.lighthouse.decoding import Decoded, DeviceDecoder
from lobstr_hw.drivers.lighthouse.raw_events import RawEvents
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon

WRAP = 1 << 32
TOLERANCE_RAD = 1e-6
HEADING = "## Lighthouse decoding"
UNEXTENDED = 1 << 24
"""Until its first IMU sample the reference has light times of 24 bits; nobody can compare those."""
Row = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Agreement:
    """One kind of event of one device against the reference.

    ``extra`` are those that only we have: outside the reference's first to last event of the kind,
    and within.
    """

    capture: str
    device: str
    kind: str
    reference: int
    equal: int
    extra_outside: int
    extra_within: int

    @property
    def share(self) -> float:
        """Of the reference's events that are equal to ours."""
        return self.equal / self.reference if self.reference else 1.0


@dataclass(frozen=True, slots=True)
class Capture:
    """A decoded capture."""

    name: str
    devices: tuple[CapturedDevice, ...]
    events: tuple[RawEvents, ...]
    decoded: tuple[Decoded | None, ...]
    seconds: float


def decode_capture(path: Path) -> Capture:
    """Everything of one usbmon file."""
    start = time.perf_counter()
    devices = tuple(read_devices(read_usbmon(path)).values())
    events = tuple(device.reader.take() for device in devices)
    decoded = tuple(
        DeviceDecoder(device.model, device.ranges).decode(batch) if device.model else None
        for device, batch in zip(devices, events, strict=True)
    )
    seconds = time.perf_counter() - start
    return Capture(path.name.removesuffix(".pcap.gz"), devices, events, decoded, seconds)


def compare(capture: Capture, reference_path: Path) -> Iterator[Agreement]:
    """Every kind of event of every device in a reference file."""
    reference = np.load(reference_path)
    for name in sorted({key.split("_")[0] for key in reference.files}):
        at = _same_device(capture, reference[f"{name}_imu"])
        ours = _rows(capture.devices[at], capture.events[at], capture.decoded[at])
        for kind, values in ours.items():
            if f"{name}_{kind}" in reference.files:
                theirs = _reference_rows(kind, reference[f"{name}_{kind}"])
                yield _agreement(capture.name, name, kind, theirs, values)


def _same_device(capture: Capture, imu: Ints) -> int:
    """Which device of the capture has most of these IMU samples."""
    times = [np.isin(imu[:, 0], events.imu[:, 0] % WRAP).sum() for events in capture.events]
    return int(np.argmax(times))


Table = dict[Row, list[float]]
"""Identity of an event, its time first -> the angle, or 0, of each event of that identity."""


def _rows(device: CapturedDevice, events: RawEvents, decoded: Decoded | None) -> dict[str, Table]:
    """Our events; sweeps and angles by the model's sensors, pulses by ports, as the reference."""
    rows = {int(port): row for row, port in enumerate(device.model.ports)} if device.model else {}
    tables = {
        "imu": _table(events.imu[:, 0], events.imu[:, 1:]),
        "pulse": _table(events.pulses[:, 1], events.pulses[:, [0, 2]]),
        "sync": _table(events.syncs[:, 1], events.syncs[:, [0, 2, 3]]),
    }
    sweeps = events.sweeps[[int(port) in rows for port in events.sweeps[:, 1]]].copy()
    sweeps[:, 1] = [rows[int(port)] for port in sweeps[:, 1]]
    tables["sweep"] = _table(sweeps[:, 2], sweeps[:, [0, 1, 3]])
    if decoded is not None:
        a = decoded.angles
        table = _table(a.ticks, np.stack([a.station, a.axis, a.sensor], axis=1), a.angle_rad)
        tables["angle1"] = tables["angle2"] = table
    return tables


def _reference_rows(kind: str, values: NDArray[np.float64]) -> Table:
    whole = values.astype(np.int64)
    match kind:
        case "imu":
            return _table(whole[:, 0], whole[:, 1:])
        case "pulse":
            return _table(whole[:, 1], whole[:, [0, 2]])
        case "sync":
            return _table(whole[:, 1], whole[:, [0, 2, 3]])
        case "sweep":
            return _table(whole[:, 2], whole[:, [0, 1, 3]])
    return _table(whole[:, 3], whole[:, :3], values[:, 4])


def _table(ticks: Ints, others: Ints, angles: NDArray[np.float64] | None = None) -> Table:
    table: Table = {}
    columns = np.concatenate([ticks[:, None] % WRAP, others], axis=1).tolist()
    for key, angle in zip(columns, [0.0] * len(ticks) if angles is None else angles, strict=True):
        table.setdefault(tuple(key), []).append(float(angle))
    return table


def _agreement(capture: str, device: str, kind: str, theirs: Table, ours: Table) -> Agreement:
    equal = sum(_matches(angles, ours.get(key, [])) for key, angles in theirs.items())
    origin = next((key[0] for key in theirs if key[0] >= UNEXTENDED), 0)
    times = [_after(origin, key[0]) for key in theirs if key[0] >= UNEXTENDED] or [0]
    extra = [
        min(times) <= _after(origin, key[0]) <= max(times)
        for key, angles in ours.items()
        for _ in range(len(angles) - min(len(angles), len(theirs.get(key, []))))
    ]
    total = sum(len(angles) for angles in theirs.values())
    return Agreement(capture, device, kind, total, equal, len(extra) - sum(extra), sum(extra))


def _after(origin: int, ticks: int) -> int:
    """Ticks after another, or before it, where both wrap."""
    return (ticks - origin + WRAP // 2) % WRAP - WRAP // 2


def _matches(theirs: list[float], ours: list[float]) -> int:
    """How many of equal identity have equal angles too."""
    left = list(ours)
    count = 0
    for angle in theirs:
        near = [other for other in left if abs(other - angle) <= TOLERANCE_RAD]
        if near:
            left.remove(near[0])
            count += 1
    return count


def section(captures: list[Capture], found: list[Agreement], command: str) -> str:
    """The section of docs/results.md."""
    lines = [
        HEADING,
        "",
        "USB captures of real devices (usbmon) against what the reference decoder makes of them:"
        " equal to the tick, angles to 1e-6 rad. Only ours: outside the reference's first to last"
        " event of the kind, and within.",
        "",
        f"`{command}`, {datetime.date.today().isoformat()}.",
        "",
        "| capture | device | events | reference | equal | % | only ours: outside / within |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {a.capture} | {a.device} | {a.kind} | {a.reference} | {a.equal} | {100 * a.share:.2f} |"
        f" {a.extra_outside} / {a.extra_within} |"
        for a in found
    ]
    return "\n".join([*lines, "", WHY, "", *_stations(captures), "", *_speed(captures), ""])


WHY = """\
Why some differ, and what only we have:

- IMU, within: a report holds the newest three samples in any order; the reference goes through them
  as they stand and drops one that stands after a newer one. Done its way, our parser gives exactly
  its samples, none more, none less.
- Outside, all of them before: the reference waits for a device's configuration and, in Gen1, longer
  until it is sure of the stations' rhythm.
- The first light: until its first IMU sample the reference lacks the upper 8 of 32 bits of light
  times and goes on without, or with those of before; our light waits until the samples run (50 ms),
  and is left out by 24 bits where reports of before were left over in the device.
- Gen1 angles, within: pulses of 50 to 100 ticks at the edge of the light, of which the reference
  leaves out a few.
- Gen1 angles that are off (one wand): its flashes were seen by other sensors than before, up to
  1200 ticks late, and the two decoders differ about when to believe one.
- Gen2 angles that are off: in the turn after a missed sync, whose period we measure."""


def _stations(captures: list[Capture]) -> list[str]:
    lines = [
        "Base stations that were read (OOTX, CRC right):",
        "",
        "| capture | device | station | id | generation |",
        "|---|---|---|---|---|",
    ]
    for capture in captures:
        for device, decoded in zip(capture.devices, capture.decoded, strict=True):
            if device.model is None or decoded is None:
                continue
            lines += [
                f"| {capture.name} | {device.model.serial} | {key} | {c.id:08x} | {c.generation} |"
                for key, c in sorted(decoded.stations.items())
            ]
    return lines


def _speed(captures: list[Capture]) -> list[str]:
    lines = [
        "Speed, file to angles, one process:",
        "",
        "| capture | events (IMU, pulses, syncs, sweeps) | seconds | events per second |",
        "|---|---|---|---|",
    ]
    for capture in captures:
        count = sum(len(events) for events in capture.events)
        speed = count / capture.seconds
        lines.append(f"| {capture.name} | {count} | {capture.seconds:.2f} | {speed:,.0f} |")
    return lines


def main() -> int:
    """Print the section; write it where asked; fail below 99.5 %."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=_Raw)
    parser.add_argument("captures", type=Path)
    parser.add_argument("decoded", type=Path)
    parser.add_argument("--write", type=Path, help="a file with such a section, to be replaced")
    asked = parser.parse_args()
    captures = [decode_capture(path) for path in sorted(asked.captures.glob("*.pcap.gz"))]
    found = [
        agreement
        for capture in captures
        if (path := asked.decoded / f"{capture.name}.npz").exists()
        for agreement in compare(capture, path)
    ]
    command = "python tools/lighthouse_decode.py lighthouse/usbmon lighthouse/decoded"
    text = section(captures, found, command)
    print(text)
    if asked.write is not None:
        write_section(text, asked.write)
    worst = min((a.share for a in found), default=0.0)
    return 0 if worst >= 0.995 else 1


class _Raw(argparse.RawDescriptionHelpFormatter):
    pass


if __name__ == "__main__":
    sys.exit(main())
