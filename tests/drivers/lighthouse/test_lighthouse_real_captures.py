"""Captures of real devices against the reference decoder (LOBSTR_DATA names the folder of data)."""

import csv
import os
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from lighthouse_decode import compare, decode_capture

from lobstr_hw.drivers.lighthouse.angles import StationCalibration
from lobstr_hw.drivers.lighthouse.decoding import DeviceDecoder
from lobstr_hw.drivers.lighthouse.device_config import parse_config
from lobstr_hw.drivers.lighthouse.recordings import read_recording
from lobstr_hw.drivers.lighthouse.reprojection import reproject

ENOUGH = 0.995
STATIONS = {
    "WM1-wand": {0x0AA54F65, 0xF77E21F3},
    "wireless-tracker": {0x0AA54F65, 0xF77E21F3},
    "lh2_test_cal": {0xA4DBC8A4, 0xDADD6923},
    "vive-index-cal": {0xA4DBC8A4, 0xDADD6923},
    "tracker-lh-move": {0xA4DBC8A4, 0x4096B5A0, 0xCA94A6B6, 0x10D7E7BF},
}
"""Those that a capture is long enough for."""


@pytest.fixture(scope="module")
def folder() -> Path:
    named = os.environ.get("LOBSTR_DATA")
    if named is None or not (Path(named) / "lighthouse").is_dir():
        pytest.skip("set LOBSTR_DATA to the folder that holds lighthouse/ to run this")
    return Path(named) / "lighthouse"


def test_what_the_reference_decodes_is_decoded(folder: Path) -> None:

    references = sorted((folder / "decoded").glob("*.npz"))
    assert references
    for reference in references:
        capture = decode_capture(folder / "usbmon" / f"{reference.stem}.pcap.gz")
        found = list(compare(capture, reference))
        assert found
        for agreement in found:
            assert agreement.share >= ENOUGH, agreement


@pytest.mark.parametrize("name", STATIONS)
def test_every_station_of_a_long_capture_tells_its_calibration(folder: Path, name: str) -> None:
    for device in read_recording(folder / "usbmon" / f"{name}.pcap.gz"):
        if device.model is None:
            continue
        decoded = DeviceDecoder(device.model, device.ranges).decode(device.events)
        assert {station.id for station in decoded.stations.values()} == STATIONS[name]


def test_a_capture_of_windows_holds_the_station_whose_memory_was_read_out(folder: Path) -> None:
    (memory,) = (folder / "configs").glob("bs_eeprom_*.bin")
    serial = memory.name.split("_")[2]
    model = parse_config((folder / "configs" / "LHR-F7EFD942_controller.json").read_bytes())
    (capture,) = (folder / "usbpcap").glob("*lying_on_the_floor*")
    (device,) = read_recording(capture, model)
    assert device.model is not None
    decoded = DeviceDecoder(device.model).decode(device.events)
    assert int(serial, 16) in {station.id for station in decoded.stations.values()}


def test_gravity_is_one_g_where_a_device_lies_still(folder: Path) -> None:
    (device,) = read_recording(folder / "usbmon" / "tracker-lh-move.pcap.gz")
    assert device.model is not None
    imu = DeviceDecoder(device.model, device.ranges).decode(device.events).imu
    still = np.linalg.norm(imu.gyro_rad_s, axis=1) < 0.05
    assert still.sum() > 100
    assert abs(np.median(np.linalg.norm(imu.acc_g[still], axis=1)) - 1) < 0.02


@pytest.mark.parametrize(("generation", "tolerance"), [("1", 1e-6), ("2", 1e-5)])
def test_reprojection_is_the_reference_s(folder: Path, generation: str, tolerance: float) -> None:
    stations = defaultdict(list)
    with (folder / "sim" / "reprojection.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["gen"] == generation:
                stations[row["bs_id"]].append({k: float(v) for k, v in row.items() if k != "bs_id"})
    assert stations
    for rows in stations.values():
        pair = {
            k[:-1]: np.array([rows[0][k], rows[0][k[:-1] + "1"]]) for k in rows[0] if k[-1] == "0"
        }
        angles = np.array([[row["angle0"], row["angle1"]] for row in rows])
        calibration = StationCalibration(
            generation=int(generation),
            phase=pair["phase"],
            tilt=pair["tilt"],
            curve=pair["curve"],
            gibphase=pair["gibpha"],
            gibmag=pair["gibmag"],
            ogeephase=pair["ogeephase"],
            ogeemag=pair["ogeemag"],
        )
        points = np.array([[row["x"], row["y"], row["z"]] for row in rows])
        np.testing.assert_allclose(reproject(calibration, points), angles, atol=tolerance)
