"""What follows from a capture's reports when they are handed out in another order."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from lobstr_hw.drivers.lighthouse.captured_device import CapturedDevice
from lobstr_hw.drivers.lighthouse.decoding import DeviceDecoder
from lobstr_hw.drivers.lighthouse.light import Stations, join_angles
from lobstr_hw.drivers.lighthouse.recorded_tracking import RecordedTake, read_takes, solve_takes
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon
from lobstr_hw.errors import FileFormatError, StationsNotSolved
from lobstr_hw.rotations import Array


def takes_and_stations(path: Path, solve: bool) -> tuple[list[RecordedTake], Stations]:
    """The devices of a capture; no stations where it does not tell where they stand.

    Args:
        path: the capture.
        solve: find out where the stations stand; else there are none.
    """
    try:
        takes = read_takes(path)
    except FileFormatError:
        return [], {}
    try:
        return takes, solve_takes(takes).stations if solve else {}
    except StationsNotSolved:
        return takes, {}


def reports_of_device(path: Path, address: int) -> list[UsbReport]:
    """All of one device, in the order of the file."""
    return [report for report in read_usbmon(path) if report.device[1] == address]


def reorder(reports: Sequence[UsbReport], order: str, ends: Sequence[int]) -> Iterator[UsbReport]:
    """The reports of a device as the file has them, their inputs as they were handed out."""
    inputs: dict[int, list[UsbReport]] = defaultdict(list)
    for report in reports:
        if report.kind is ReportKind.INPUT:
            inputs[ends.index(report.endpoint)].append(report)
    queues = {interface: iter(queue) for interface, queue in inputs.items()}
    handed_out = iter(order)
    for report in reports:
        if report.kind is ReportKind.INPUT:
            yield next(queues[int(next(handed_out))])
        else:
            yield report


def track(take: RecordedTake, reports: Iterator[UsbReport], stations: Stations) -> TimedPoses:
    """The poses of one device, from its reports in this order."""
    captured = CapturedDevice(take.given)
    ranges = take.recording.ranges
    tracked = TrackedDevice(take.model, stations, ranges, captured.reader)
    for report in reports:
        captured.feed(report)
        tracked.advance()
    return tracked.poses()


def far_apart(a: TimedPoses, b: TimedPoses) -> tuple[int, float]:
    """How many poses are tracked in one of two tracks only, and by how much the others differ."""
    only = np.setxor1d(a.ticks[a.tracked], b.ticks[b.tracked])
    _, i, j = np.intersect1d(a.ticks[a.tracked], b.ticks[b.tracked], return_indices=True)
    i, j = np.flatnonzero(a.tracked)[i], np.flatnonzero(b.tracked)[j]
    turned = np.abs(a.R[i] - b.R[j]).max(initial=0.0)
    return len(only), float(max(np.abs(a.p[i] - b.p[j]).max(initial=0.0), turned))


def hits(take: RecordedTake, reports: Iterator[UsbReport]) -> Array:
    """(m, 5) what the stations' light hit of one device: ticks, station, axis, sensor, angle."""
    captured = CapturedDevice(take.given)
    for report in reports:
        captured.feed(report)
    decoder = DeviceDecoder(take.model, take.recording.ranges)
    captured.reader.finish()
    a = join_angles([decoder.decode(captured.reader.take()).angles])
    return np.stack([a.ticks, a.station, a.axis, a.sensor, a.angle_rad], axis=1)


def compare(
    take: RecordedTake,
    stations: Stations,
    reports: Sequence[UsbReport],
    order: str,
    ends: Sequence[int],
) -> tuple[int, int, float]:
    """What the order changes of a device's tracked poses, or without stations of its hits.

    Args:
        take: the device.
        stations: by which it is tracked.
        reports: its reports, as the file has them.
        order: the interface of each input report, in the other order.
        ends: endpoint by interface.

    Returns:
        How many there are by the file, how many there are in one order only, and the largest
        difference of the others.
    """
    if stations:
        from_file = track(take, iter(reports), stations)
        other = track(take, reorder(reports, order, ends), stations)
        return int(from_file.tracked.sum()), *far_apart(other, from_file)
    expected, found = hits(take, iter(reports)), hits(take, reorder(reports, order, ends))
    keys, found_keys = (set(map(tuple, h[:, :4].tolist())) for h in (expected, found))
    only = len(keys ^ found_keys)
    apart = 0.0 if only else float(np.abs(expected - found).max(initial=0.0))
    return len(expected), only, apart
