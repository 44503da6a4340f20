"""``lobstr-log import`` of Lighthouse recordings, of a made-up room and real ones where named."""

import json
import os
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.lighthouse_devices import named, scripted_device
from support.lighthouse_room import carried, room
from support.lighthouse_wire import config_of, reports_of

from lobstr_hw.drivers.lighthouse.station_file import save_stations
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon_writer import UsbmonWriter
from lobstr_hw.drivers.tracker_log import read_log
from lobstr_hw.runtime.commands.log import main

MODEL = named("LHR-0000000A")
SECONDS = 0.5
BEGUN_S = 1_700_000_000.0


def capture(path: Path, seconds: float = SECONDS, config: bool = True) -> Path:
    """A tracker by cable, as usbmon sees it."""
    motion = carried(1)
    device = scripted_device(MODEL, reports_of(room(2), MODEL, motion, max(seconds, 0.1)))
    writer = UsbmonWriter(path)
    for answers in device.features.values() if config else ():
        for answer in answers:
            writer.add(UsbReport((1, 2), BEGUN_S, ReportKind.FEATURE_GET, 0, answer))
    for time_s, interface, data in device.reports:
        if time_s < seconds:
            endpoint = device.ends[interface]
            report = UsbReport((1, 2), BEGUN_S + time_s, ReportKind.INPUT, endpoint, data)
            writer.add(report)
    writer.close()
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return capture(tmp_path_factory.mktemp("capture") / "take.pcap")


@pytest.fixture
def stations(tmp_path: Path) -> Path:
    path = tmp_path / "stations.json"
    save_stations(path, room(2), {})
    return path


def test_a_capture_becomes_a_log_with_the_poses_at_their_times(
    recording: Path, stations: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "take.mcap"
    assert main(["import", str(recording), str(out), "--stations", str(stations), "--json"]) == 0
    (device,) = json.loads(capsys.readouterr().out)["devices"]
    assert device["serial"] == MODEL.serial
    log = read_log(out)
    samples = list(log.samples())
    assert len(samples) == device["samples"] > 50
    assert log.unix_offset_s is not None
    t = np.array([s.time_s for s in samples]) + log.start_s + log.unix_offset_s - BEGUN_S
    p = np.stack([s.T_world_tracker.p for s in samples if s.T_world_tracker.p is not None])
    # times of a capture are doubles of seconds since 1970: good to a quarter of a microsecond
    assert np.max(np.linalg.norm(p - carried(1).p(t), axis=1)) < 0.02
    assert np.median(np.linalg.norm(p - carried(1).p(t), axis=1)) < 0.002


def test_a_recording_after_another_of_the_same_device_comes_later(
    recording: Path, stations: Path, tmp_path: Path
) -> None:
    out, twice = tmp_path / "one.mcap", tmp_path / "two.mcap"
    known = ["--stations", str(stations)]
    assert main(["import", str(recording), "--output", str(out), *known]) == 0
    again = [str(recording), str(recording), "--output", str(twice)]
    assert main(["import", *again, *known]) == 0
    one, two = ([s.time_s for s in read_log(path).samples()] for path in (out, twice))
    assert len(two) == 2 * len(one)
    assert (np.diff(two) > 0).all()


def refused(arguments: Sequence[object], capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert main(["import", *map(str, arguments)]) == 1
    return capsys.readouterr().err


def test_what_is_missing_is_told_with_what_to_do(
    recording: Path, stations: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.mcap"
    nobody = capture(tmp_path / "nobody.pcap", 0.0)
    assert "no Lighthouse device says anything" in refused([nobody, out], capsys)
    blind = capture(tmp_path / "blind.pcap", config=False)
    assert "--config FILE" in refused([blind, out], capsys)
    assert "--stations" in refused([recording, out], capsys)  # too short for a calibration
    assert "LOG.mcap" in refused([recording], capsys)
    assert not out.exists()
    config = tmp_path / "tracker.json"
    config.write_bytes(zlib.decompress(config_of(MODEL)))
    for known in (config, recording):
        given = ["--config", str(known), "--stations", str(stations)]
        assert main(["import", str(blind), str(out), *given]) == 0
        out.unlink()


@pytest.fixture(scope="module")
def folder() -> Path:
    named_folder = os.environ.get("LOBSTR_DATA")
    if named_folder is None or not (Path(named_folder) / "lighthouse").is_dir():
        pytest.skip("set LOBSTR_DATA to the folder that holds lighthouse/ to run this")
    return Path(named_folder) / "lighthouse"


@pytest.mark.parametrize("name", ["usbmon/lh2_test_cal.pcap.gz"])
def test_real_captures_are_imported(folder: Path, name: str, tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    assert main(["import", str(folder / name), "--output", str(out)]) == 0
    samples = list(read_log(out).samples())
    assert np.mean([s.tracked for s in samples]) > 0.95


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("usbmon/wand-all-buttons.pcap.gz", "no base station was seen"),
        ("usbmon/tracker-gen2-wired-buttons.pcap.gz", "none of them got to say its calibration"),
    ],
)
def test_real_captures_that_show_too_little_say_so(
    folder: Path, name: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert why in refused([folder / name, tmp_path / "out.mcap"], capsys)


def test_recordings_without_a_common_clock_are_refused(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, out = tmp_path / "take.rec", tmp_path / "out.mcap"
    text.write_text("0.01 WM0 CONFIG {}\n", encoding="utf-8")
    assert main(["import", str(recording), str(text), "--output", str(out)]) == 1
    assert "Import each kind into a log of its own" in capsys.readouterr().err
    assert not out.exists()
