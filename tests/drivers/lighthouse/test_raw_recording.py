"""What went over USB is written down, and gives the same poses once more."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.fake_clock import FakeClock
from support.lighthouse_devices import Bench, named, scripted_device
from support.lighthouse_room import carried, room
from support.lighthouse_wire import reports_of

from lobstr_hw.drivers import reading_thread, stream
from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.lighthouse.recorded_tracking import read_takes, track_takes
from lobstr_hw.drivers.lighthouse.station_file import load_stations, save_stations
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon
from lobstr_hw.drivers.lighthouse.usbmon_writer import UsbmonWriter
from lobstr_hw.errors import DriverUnavailable, OutputError
from lobstr_hw.trackers import TrackerSample, TrackingState

SECONDS = 0.6


@pytest.fixture(scope="module")
def stations_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("room") / "stations.json"
    save_stations(path, room(2), {})
    return path


@pytest.fixture(scope="module")
def take(
    stations_file: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Sequence[TrackerSample]]:
    """A capture of two trackers that are carried about, and what the driver gave."""
    path = tmp_path_factory.mktemp("raw") / "take.pcap"
    devices = [
        scripted_device(model, reports_of(room(2), model, carried(k), SECONDS, seed=k), 2 + k)
        for k, model in enumerate([named("LHR-0000000A"), named("LHR-0000000B")])
    ]
    clock = FakeClock()
    bench = Bench(devices, clock, lambda t: LighthouseDriver(stations_file, t, path))
    with pytest.MonkeyPatch.context() as patched:
        for module in (stream, reading_thread):
            patched.setattr(module, "perf_counter", clock.now_s)
        with bench.driver:
            samples = bench.run_to(clock.now_s() + SECONDS + 0.1, 0.1)
    assert all(not device.opened for device in bench.devices)
    return path, samples


def test_a_capture_that_was_written_raw_gives_the_driver_s_poses_again(
    take: tuple[Path, Sequence[TrackerSample]], stations_file: Path
) -> None:
    path, samples = take
    takes = read_takes(path)
    assert {t.model.serial for t in takes} == {"LHR-0000000A", "LHR-0000000B"}
    for one, poses in zip(takes, track_takes(takes, load_stations(stations_file)), strict=True):
        live = [s for s in samples if s.serial == one.model.serial]
        live = [s for s in live if s.T_world_tracker.p is not None]
        assert len(live) > 100
        assert len(poses) >= len(live)
        np.testing.assert_array_equal([s.T_world_tracker.p for s in live], poses.p[: len(live)])
        np.testing.assert_array_equal([s.T_world_tracker.R for s in live], poses.R[: len(live)])
        assert [s.tracked for s in live] == poses.tracked[: len(live)].tolist()


def test_times_of_a_capture_are_the_device_s_own_on_the_host_s_clock(
    take: tuple[Path, Sequence[TrackerSample]],
) -> None:
    for one in read_takes(take[0]):
        seconds = one.clock.seconds(one.take.imu.ticks)
        np.testing.assert_allclose(np.diff(seconds), 0.004, atol=2e-5)


def test_every_kind_of_report_comes_back_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "a.pcap"
    content = [
        UsbReport((1, 2), 1_700_000_000.25, ReportKind.FEATURE_SET, 0, b"\x04\x01\0\0\0"),
        UsbReport((1, 2), 1_700_000_000.5, ReportKind.FEATURE_GET, 0, b"\x01\x03\x02"),
        UsbReport((2, 127), 1_700_000_000.75, ReportKind.INPUT, 0x83, bytes(range(64))),
    ]
    writer = UsbmonWriter(path)
    for report in content:
        writer.add(report)
    writer.close()
    writer.close()
    writer.add(content[0])
    assert list(read_usbmon(path)) == content


def test_a_folder_that_is_missing_is_told(tmp_path: Path) -> None:
    path = tmp_path / "none" / "a.pcap"
    with pytest.raises(OutputError, match="make this one first"):
        UsbmonWriter(path)


FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.exists(), reason="a disk that is always full is Linux's")
def test_a_full_disk_ends_the_capture_is_told_once_and_stops_no_device(
    stations_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, clock = named("LHR-0000000A"), FakeClock()
    for module in (stream, reading_thread):
        monkeypatch.setattr(module, "perf_counter", clock.now_s)
    script = scripted_device(model, reports_of(room(2), model, carried(1), SECONDS))
    bench = Bench([script], clock, lambda t: LighthouseDriver(stations_file, t, FULL))
    with bench.driver:
        samples = bench.run_to(clock.now_s() + SECONDS, 0.1)
        assert ["Free space" in words for words in bench.words()] == [True]
        assert not bench.words()
    assert samples[-1].tracked
    assert not [s for s in samples if s.state is TrackingState.GONE]


@pytest.mark.skipif(not FULL.exists(), reason="a disk that is always full is Linux's")
def test_a_disk_that_is_full_at_the_end_is_no_error_of_closing() -> None:
    writer = UsbmonWriter(FULL)
    writer.close()
    writer.close()
    assert "Free space" in writer.problem


def test_a_capture_that_cannot_be_written_leaves_no_device_open(
    stations_file: Path, tmp_path: Path
) -> None:
    device = scripted_device(named("LHR-0000000A"), [])
    raw = tmp_path / "none" / "a.pcap"
    bench = Bench([device], FakeClock(), lambda t: LighthouseDriver(stations_file, t, raw))
    with pytest.raises(DriverUnavailable, match="make this one first"):
        bench.driver.open()
    assert bench.devices[0].opened == 0
