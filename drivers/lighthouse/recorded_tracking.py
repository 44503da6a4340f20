"""A recording of Lighthouse devices -> where they were: decode it, solve the stations, track.

USB captures go through :class:`TrackedDevice` report by report, in their order, as live ones do, so
that both give the same poses; libsurvive's text, which holds events, in one go.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from lobstr_hw.drivers.lighthouse.angles import (
    TICKS_PER_S,
    DeviceModel,
    ImuSamples,
    StationCalibration,
)
from lobstr_hw.drivers.lighthouse.capture_clock import CaptureClock
from lobstr_hw.drivers.lighthouse.captured_device import CapturedDevice
from lobstr_hw.drivers.lighthouse.decoding import DeviceDecoder
from lobstr_hw.drivers.lighthouse.light import Stations, join_angles
from lobstr_hw.drivers.lighthouse.recordings import (
    DeviceRecording,
    device_name,
    read_recording,
    usb_reports,
)
from lobstr_hw.drivers.lighthouse.station_solve import StationSolution, solve_stations
from lobstr_hw.drivers.lighthouse.station_views import Take
from lobstr_hw.drivers.lighthouse.timed_poses import TimedPoses
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.drivers.lighthouse.tracker_state import TrackerSettings
from lobstr_hw.drivers.lighthouse.usb_report import UsbReport
from lobstr_hw.errors import FileFormatError, StationsNotSolved

__all__ = ["RecordedTake", "calibrations_of", "read_takes", "solve_takes", "track_takes"]


@dataclass(frozen=True, slots=True, eq=False)
class RecordedTake:
    """One device of a recording, decoded.

    Attributes:
        path: the file.
        recording: what it holds of the device.
        take: its IMU samples and angles, by time.
        heard: what stations told it about themselves, by number.
        given: its model was, where the file does not have it.
    """

    path: Path
    recording: DeviceRecording
    take: Take
    heard: dict[int, StationCalibration]
    given: DeviceModel | None = None

    @property
    def model(self) -> DeviceModel:
        """What it is."""
        return self.take.model

    @property
    def clock(self) -> CaptureClock:
        """Its time beside the file's."""
        return self.recording.clock


def read_takes(path: Path, model: DeviceModel | None = None) -> list[RecordedTake]:
    """The devices of a recording whose configuration is known.

    Args:
        path: what ``read_recording`` takes.
        model: of the device whose configuration the capture did not see being read.

    Raises:
        FileFormatError: there is no such device in it; says why, and what to do.
    """
    recordings = [d for d in read_recording(path, model) if len(d.events.imu) or d.unread]
    if not recordings:
        raise FileFormatError(
            f"{path}: no Lighthouse device says anything in it. Was the right bus recorded, "
            "and a tracker switched on?"
        )
    known = [d for d in recordings if d.model is not None]
    if not known:
        raise FileFormatError(
            f"{path}: {_unknown(recordings[0])}. Devices are asked for their configuration when a "
            "program begins to use them: record from before that, or name it with --config FILE "
            "(its JSON, or a recording that has it)."
        )
    return [_decoded(path, recording, model) for recording in known]


def _unknown(recording: DeviceRecording) -> str:
    if recording.problem:
        return f"device {recording.name}: {recording.problem}"
    return f"the configuration of device {recording.name} is not in it"


def _decoded(path: Path, recording: DeviceRecording, given: DeviceModel | None) -> RecordedTake:
    assert recording.model is not None
    decoded = DeviceDecoder(recording.model, recording.ranges).decode(recording.events)
    take = Take(recording.model, decoded.imu, join_angles([decoded.angles]))
    return RecordedTake(path, recording, take, decoded.stations, given)


def calibrations_of(takes: Sequence[RecordedTake]) -> dict[int, StationCalibration]:
    """What stations told about themselves, by number."""
    return {number: said for take in takes for number, said in take.heard.items()}


def solve_takes(takes: Sequence[RecordedTake]) -> StationSolution:
    """Where the stations of recordings stand; they stood there in all of them.

    Raises:
        StationsNotSolved: there was too little light; says what was seen, and what to do.
    """
    seen = sorted({int(n) for take in takes for n in set(take.take.angles.station.tolist())})
    calibrations = calibrations_of(takes)
    seconds = max(_seconds(take.take.imu) for take in takes)
    if not seen:
        raise StationsNotSolved(
            f"no base station was seen in {seconds:.0f} s. Name a file of the stations with "
            "--stations, or record in their light."
        )
    if not calibrations:
        raise StationsNotSolved(
            f"base stations {', '.join(map(str, seen))} were seen, but in {seconds:.0f} s none of "
            "them got to say its calibration, for which it needs up to 20 s of steady light. "
            "Record longer, or name a file of the stations with --stations."
        )
    return solve_stations([take.take for take in takes], calibrations)


def _seconds(imu: ImuSamples) -> float:
    return float(imu.ticks[-1] - imu.ticks[0]) / TICKS_PER_S if len(imu) else 0.0


def track_takes(
    takes: Sequence[RecordedTake],
    stations: Stations,
    settings: TrackerSettings | None = None,
) -> list[TimedPoses]:
    """The poses of devices of one file, in the order of the takes.

    Args:
        takes: of :func:`read_takes`.
        stations: where they stand.
        settings: of the tracking.
    """
    captured = [CapturedDevice(take.given) for take in takes]
    tracked = [
        TrackedDevice(take.model, stations, take.recording.ranges, device.reader, settings)
        for take, device in zip(takes, captured, strict=True)
    ]
    reports = usb_reports(takes[0].path)
    if reports is not None:
        names = [take.recording.name for take in takes]
        _replay(reports, dict(zip(names, zip(captured, tracked, strict=True), strict=True)))
    else:
        for device, take in zip(tracked, takes, strict=True):
            device.feed_events(take.recording.events)
    return [device.poses() for device in tracked]


def _replay(
    reports: Iterable[UsbReport], devices: Mapping[str, tuple[CapturedDevice, TrackedDevice]]
) -> None:
    for report in reports:
        device = devices.get(device_name(report.device))
        if device is not None:
            device[0].feed(report)
            device[1].advance()
