"""Captures and recordings, written here byte by byte, read back; cut and damaged ones too."""

import gzip
import json
import struct
import zlib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lobstr_hw.drivers.lighthouse.recordings import read_recording
from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
from lobstr_hw.drivers.lighthouse.usbmon import read_usbmon
from lobstr_hw.drivers.lighthouse.usbpcap import read_usbpcap
from lobstr_hw.errors import FileFormatError

CONFIG = {
    "device_serial_number": "LHR-89ABCDEF",
    "device_class": "generic_tracker",
    "device_pid": 0x2300,
    "trackref_from_imu": [0, 0, 0, 1, 0, 0, 0],
    "lighthouse_config": {
        "modelPoints": [[0.01 * k, 0.0, 0.0] for k in range(5)],
        "modelNormals": [[0.0, 0.0, 1.0]] * 5,
        "channelMap": [3, 4, 5, 6, 7],
    },
}
IMU = b"\x20" + struct.pack("<6hIB", 1, 2, 3, 4, 5, 6, 1_000, 0) * 3
WORDS = b"\x31" + struct.pack("<II", 2_000 << 2 | 1 << 26, 2 | 3_000 << 3 | 5 << 27)
LIGHT = b"\x28" + bytes([len(WORDS)]) + WORDS.ljust(62, b"\0")
GET, SET = ReportKind.FEATURE_GET, ReportKind.FEATURE_SET


def config_answers() -> list[bytes]:
    packed = zlib.compress(json.dumps(CONFIG).encode())
    pieces = [packed[k : k + 62] for k in range(0, len(packed), 62)] + [b""]
    start = b"\x10" + struct.pack(">H", len(packed)).ljust(63, b"\0")
    return [start, *(bytes([0x11, len(p)]) + p.ljust(62, b"\0") for p in pieces)]


def reports(device: tuple[int, int] = (1, 9)) -> list[UsbReport]:
    """A tracker by cable: configuration, ranges, light mode, then its data."""
    made = [UsbReport(device, 1.0, GET, 0, data) for data in config_answers()]
    made.append(UsbReport(device, 1.0, GET, 0, b"\x01\x03\x02"))
    made.append(UsbReport(device, 1.0, SET, 0, b"\x04\x01\0\0\0"))
    made += [UsbReport(device, 1.5, ReportKind.INPUT, 0x81, data) for data in (IMU, LIGHT, LIGHT)]
    return made


def usbmon_bytes(content: list[UsbReport]) -> bytes:
    made = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, 220)
    for number, report in enumerate(content):
        packets = [(b"C", 1, report.endpoint, b"\0" * 8, report.data)]
        if report.kind is GET:
            setup = bytes([0xA1, 1, report.data[0], 3, 0, 0, 64, 0])
            packets = [(b"S", 2, 0x80, setup, b""), (b"C", 2, 0x80, b"\0" * 8, report.data)]
        elif report.kind is SET:
            setup = bytes([0x21, 9, report.data[0], 3, 0, 0, 64, 0])
            packets = [(b"S", 2, 0, setup, report.data), (b"C", 2, 0, b"\0" * 8, b"")]
        for kind, transfer, endpoint, setup, data in packets:
            bus, address = report.device
            seconds, micro = divmod(round(report.time_s * 1e6), 1_000_000)
            head = struct.pack("<QcBBBHBB", number, kind, transfer, endpoint, address, bus, 0, 0)
            head += struct.pack("<qiiII8s", seconds, micro, 0, len(data), len(data), setup)
            packet = head.ljust(64, b"\0") + data
            made += struct.pack("<IIII", seconds, micro, len(packet), len(packet)) + packet
    return made


def usbpcap_bytes(content: list[UsbReport]) -> bytes:
    made = _block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    made += _block(1, struct.pack("<HHI", 249, 0, 65_535))
    for number, report in enumerate(content):
        packets = [(1, report.endpoint, 1, report.data)]
        if report.kind is not ReportKind.INPUT:
            head = b"\xa1\x01" if report.kind is GET else b"\x21\x09"
            setup = head + bytes([report.data[0], 3, 0, 0, 64, 0])
            packets = [(0, 0, 2, setup), (int(report.kind is GET), 0, 2, report.data)]
        for info, endpoint, transfer, data in packets:
            stage = b"\0" if transfer == 2 else b""
            bus, address = report.device
            fields = (27 + len(stage), number, 0, 9, info, bus, address, endpoint, transfer)
            packet = struct.pack("<HQIHBHHBBI", *fields, len(data)) + stage + data
            time = round(report.time_s * 1e6)
            body = struct.pack("<IIIII", 0, time >> 32, time & 0xFFFFFFFF, len(packet), len(packet))
            made += _block(6, body + packet.ljust(-(-len(packet) // 4) * 4, b"\0"))
    return made


def _block(kind: int, body: bytes) -> bytes:
    length = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", kind) + length + body + length


TEXT = f"""\
0.001 INFO LOG Recording
0.002 OPTION required-meas i 8
0.500 T20 CONFIG {json.dumps(CONFIG)}
0.600 T20 IMU_SCALES 3 2
0.700 T20 i 3 1000 1.000000 2.000000 3.000000 4.000000 5.000000 6.000000  0.0 0.0 0.0 0
0.800 T20 Y 3 2000 1 0
0.900 T20 W 3 2 3000 0
0.950 T20 C 5 4000 150
0.960 T20 W 3 99 3000 0
0.970 T20 POSE 0 0 0 1 0 0 0
0.980 T20 i 3 20
""".encode()

WRITERS = {"usbmon": usbmon_bytes(reports()), "usbpcap": usbpcap_bytes(reports()), "text": TEXT}


@pytest.mark.parametrize("kind", ["usbmon", "usbpcap"])
def test_a_capture_gives_the_reports_that_were_sent(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "capture"
    path.write_bytes(WRITERS[kind])
    read = read_usbmon if kind == "usbmon" else read_usbpcap
    assert list(read(path)) == reports()


@pytest.mark.parametrize("layers", [0, 1, 2])
@pytest.mark.parametrize("kind", WRITERS)
def test_all_kinds_of_recordings_give_the_same_device(
    kind: str, layers: int, tmp_path: Path
) -> None:
    path, data = tmp_path / "recording", WRITERS[kind]
    for _ in range(layers):
        data = gzip.compress(data)
    path.write_bytes(data)
    (device,) = read_recording(path)
    assert device.model is not None
    assert device.ranges is not None
    assert (device.model.serial, device.ranges.gyro_deg_s) == ("LHR-89ABCDEF", 2000.0)
    assert device.events.imu.tolist() == [[1_000, 1, 2, 3, 4, 5, 6]]
    assert device.events.syncs[0].tolist() == [3, 2_000, 1, 0]
    assert device.events.sweeps[0].tolist() == [3, 5, 3_000, 0]
    assert len(device.events.pulses) == (kind == "text")


def test_radio_is_left_alone_until_the_tracker_is_known(tmp_path: Path) -> None:
    block = b"\x80" + struct.pack("<B6h", 5, 1, 2, 3, 4, 5, 6)
    radio = b"\x23" + (bytes([0, len(block) + 1, 1]) + block).ljust(29, b"\0")
    message = UsbReport((1, 9), 0.0, ReportKind.INPUT, 0x81, radio)
    path = tmp_path / "capture"
    path.write_bytes(usbmon_bytes([message, *reports()[:-3], message]))
    (device,) = read_recording(path)
    assert device.events.imu[:, 0].tolist() == [0x010500]


def test_half_a_configuration_is_told_and_the_device_is_still_read(tmp_path: Path) -> None:
    path = tmp_path / "capture"
    path.write_bytes(usbmon_bytes([r for k, r in enumerate(reports()) if k != 2]))
    (device,) = read_recording(path)
    assert device.model is None
    assert "configuration" in device.problem
    assert len(device.events.imu) == 1


@pytest.mark.parametrize("data", [b"", b"\x1f\x8b", b"hello", b"\xd4\xc3\xb2\xa1", bytes(500)])
def test_what_is_no_recording_is_refused(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(data)
    with pytest.raises(FileFormatError, match="file"):
        read_recording(path)
    with pytest.raises(FileFormatError, match="cannot be read"):
        read_recording(tmp_path / "nothing")


SLOW = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


@SLOW
@given(st.sampled_from(sorted(WRITERS)), st.booleans(), st.integers(0, 10_000))
def test_a_cut_file_gives_what_stands_before(
    tmp_path: Path, kind: str, packed: bool, end: int
) -> None:
    data = gzip.compress(WRITERS[kind]) if packed else WRITERS[kind]
    path = tmp_path / "cut"
    path.write_bytes(data[: end % len(data)])
    try:
        devices = read_recording(path)
    except FileFormatError:
        return
    for device in devices:
        assert len(device.events) <= 6


@SLOW
@given(st.sampled_from(sorted(WRITERS)), st.booleans(), st.data())
def test_damaged_files_give_devices_or_documented_errors(
    tmp_path: Path, kind: str, packed: bool, data: st.DataObject
) -> None:
    whole = bytearray(gzip.compress(WRITERS[kind]) if packed else WRITERS[kind])
    for _ in range(data.draw(st.integers(1, 8))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / "damaged"
    path.write_bytes(whole)
    try:
        devices = read_recording(path)
    except FileFormatError:
        return
    assert sum(len(device.events) for device in devices) < 1_000
