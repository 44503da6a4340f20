"""USB devices behind the real hidapi (both backends), pyusb and libusb: made by umockdev.

The first run of this file has one test, which runs the file again in the bed, with the rest.
"""

import ctypes.util
import importlib.util
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from support.beds import need
from support.lighthouse_bed import ENVIRONMENT, RemoteBed, use_system_libusb
from support.lighthouse_room import carried, device, room
from support.lighthouse_wire import config_of, reports_of
from support.scripted_usb import ScriptedDevice, load_script, save_script
from support.umockdev_beds import run_in_bed
from support.waiting import wait_until

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S
from lobstr_hw.drivers.lighthouse.device_commands import (
    ask_ranges,
    ask_version,
    download_config,
    start_reports,
)
from lobstr_hw.drivers.lighthouse.device_config import parse_config
from lobstr_hw.drivers.lighthouse.imu import ImuRanges
from lobstr_hw.drivers.lighthouse.transport import (
    LinkLost,
    NoAnswer,
    OpenDevice,
    Transport,
    UsbDeviceInfo,
)
from lobstr_hw.drivers.lighthouse.transports import TRANSPORTS
from lobstr_hw.drivers.lighthouse.usb_ids import DeviceKind
from lobstr_hw.errors import FileFormatError, TrackerNotFound

SCRIPT = "LOBSTR_USB_SCRIPT"
BY_CABLE, SILENT_DONGLE, STRANGER = 0, 1, 2
"""The devices of the bed."""
BATCH = 16
"""Reports under way at once: hidapi keeps 30."""
PATIENCE_S = 60.0
SERIALS = {"LHR-00000001", "DONGLE", "STRANGER"}


def config_reports(compressed: bytes) -> dict[int, list[bytes]]:
    pieces = [compressed[k : k + 62] for k in range(0, len(compressed), 62)] + [b""]
    answers = [(bytes([0x11, len(piece)]) + piece).ljust(64, b"\0") for piece in pieces]
    return {
        0x10: [(b"\x10" + len(compressed).to_bytes(2, "big")).ljust(64, b"\0")],
        0x11: answers,
    }


def made_up_devices() -> list[ScriptedDevice]:
    """A tracker by cable in a room, a dongle with nothing behind it, and something unknown."""
    model = device()
    version = b"\x05" + bytes.fromhex("78563412") + bytes(4) + b"tracker\xae\0".ljust(32, b"\x80")
    features = config_reports(config_of(model))
    features[0x01] = [bytes([1, 0, 0]).ljust(64, b"\0"), bytes([1, 3, 2]).ljust(64, b"\0")]
    features[0x05] = [version.ljust(64, b"\0")]
    reports = [
        (report.ticks / TICKS_PER_S, report.interface, report.data)
        for report in reports_of(room(2), model, carried(1), 1.5)
    ]
    ends = (0x81, 0x83, 0x84)
    return [
        ScriptedDevice(0x28DE, 0x2300, 2, "LHR-00000001", "Tracker", ends, features, reports),
        ScriptedDevice(0x28DE, 0x2101, 3, "DONGLE", "Radio", (0x81,)),
        ScriptedDevice(0x28DE, 0x20FF, 4, "STRANGER", "Thing", (0x81,)),
    ]


def read_all(bed: RemoteBed, opened: OpenDevice, count: int, number: int = 0) -> list[list[bytes]]:
    """What an open device sends of so many reports, by interface."""
    came: list[list[bytes]] = [[] for _ in opened.info.interfaces]
    for start in range(0, count, BATCH):
        bed.play(min(BATCH, count - start), number)
        for _ in range(min(BATCH, count - start)):
            report = opened.read(PATIENCE_S)
            assert report is not None, f"{sum(map(len, came))} of {count} reports came"
            came[report.interface].append(report.data)
    return came


def by_interface(script: ScriptedDevice, count: int | None = None) -> list[list[bytes]]:
    return [
        [data for _, end, data in script.reports[:count] if end == interface]
        for interface in range(len(script.ends))
    ]


def our_threads() -> list[str]:
    return [t.name for t in threading.enumerate() if t.name.startswith("lobstr")]


def open_files() -> int:
    return len(os.listdir("/proc/self/fd"))


AS_NOBODY = """
import os, sys
import hid, hidraw, usb.core, usb.util, usb.backend.libusb1, libusb_package
from lobstr_hw.drivers.lighthouse.transports import choose_transport
from lobstr_hw.errors import DriverError
transport = choose_transport(sys.argv[1])
listed = transport.enumerate()  # what is loaded by this may lie where nobody may read
os.setresgid(65534, 65534, 65534)
os.setresuid(65534, 65534, 65534)
for info in listed:
    try:
        transport.open(info).close()
    except DriverError as error:
        print(type(error).__name__, error)
"""


def is_root() -> bool:
    return sys.platform != "win32" and os.getuid() == 0


def let_nobody_look() -> None:
    """Let everybody see the bed's devices, and root alone open them."""
    root = Path(os.environ["UMOCKDEV_DIR"])
    for path in [root, *root.glob("ioctl/**/*")]:
        path.chmod(0o777)  # umockdev's own; without it its preloaded library gives up
    for node in [*root.glob("dev/hidraw*"), *root.glob("dev/bus/usb/*/*")]:
        node.chmod(0o600)


if ENVIRONMENT in os.environ:
    use_system_libusb()

    @pytest.fixture
    def bed() -> Iterator[RemoteBed]:
        bed = RemoteBed()
        yield bed
        for number in range(3):  # whatever a test did to it
            bed.unplug(number)
            bed.plug(number)
        bed.close()

    @pytest.fixture(params=TRANSPORTS, ids=lambda transport: transport.name)
    def transport(request: pytest.FixtureRequest) -> Transport:
        chosen: Transport = request.param
        return chosen

    @pytest.fixture(scope="module")
    def script() -> list[ScriptedDevice]:
        return load_script(Path(os.environ[SCRIPT]))

    def listed(transport: Transport, serials: set[str]) -> dict[str, UsbDeviceInfo]:
        """What is listed once libusb has heard of what was plugged in and out."""

        def all_there() -> bool:
            return {info.serial for info in transport.enumerate()} == serials

        wait_until(all_there, f"{serials} are listed", PATIENCE_S)
        return {info.serial: info for info in transport.enumerate()}

    def info_of(transport: Transport, serial: str) -> UsbDeviceInfo:
        return listed(transport, SERIALS)[serial]

    def opened_cable(transport: Transport) -> OpenDevice:
        return transport.open(info_of(transport, "LHR-00000001"))

    @pytest.mark.bed
    class TestDevicesOnUsb:
        def test_every_device_is_listed_once_with_its_kind_and_interfaces(
            self, bed: RemoteBed, transport: Transport
        ) -> None:
            found = listed(transport, SERIALS)
            assert {
                serial: (info.kind, [number for number, _ in info.interfaces])
                for serial, info in found.items()
            } == {
                "LHR-00000001": (DeviceKind.BY_CONFIG, [0, 1, 2]),
                "DONGLE": (DeviceKind.DONGLE, [0]),
                "STRANGER": (DeviceKind.UNKNOWN, [0]),
            }

        def test_all_reports_come_byte_for_byte_in_order(
            self, bed: RemoteBed, transport: Transport, script: list[ScriptedDevice]
        ) -> None:
            with closing(opened_cable(transport)) as opened:
                came = read_all(bed, opened, len(script[BY_CABLE].reports))
                assert came == by_interface(script[BY_CABLE])
                assert opened.read(0.0) is None
                assert opened.dropped == 0

        def test_a_device_tells_what_it_is_and_hears_what_it_is_told(
            self, bed: RemoteBed, transport: Transport
        ) -> None:
            with closing(opened_cable(transport)) as opened:
                assert parse_config(download_config(opened)).serial == device().serial
                assert ask_ranges(opened) == ImuRanges()
                version = ask_version(opened)
                assert version is not None
                assert (version.firmware, version.name) == ("12345678", "tracker.")
                start_reports(opened, gen2=True)
                told = [bytes.fromhex(text) for text in ("0401000000", "0703000000")]
                assert bed.sent() == told

        def test_what_comes_while_a_device_is_asked_is_not_lost(
            self, bed: RemoteBed, transport: Transport, script: list[ScriptedDevice]
        ) -> None:
            with closing(opened_cable(transport)) as opened:
                bed.play(BATCH)
                download_config(opened)
                came = [opened.read(PATIENCE_S) for _ in range(BATCH)]
                data = [[r.data for r in came if r and r.interface == end] for end in range(3)]
                assert data == by_interface(script[BY_CABLE], BATCH)

        def test_a_pulled_plug_is_told_after_what_came_before_it_and_a_new_one_is_found(
            self, bed: RemoteBed, transport: Transport, script: list[ScriptedDevice]
        ) -> None:
            opened_cable(transport).close()
            files = open_files()
            for _ in range(3):
                info = info_of(transport, "LHR-00000001")
                with closing(transport.open(info)) as opened:
                    came = read_all(bed, opened, 40)
                    assert came == by_interface(script[BY_CABLE], 40)
                    bed.unplug()
                    with pytest.raises(LinkLost):
                        while opened.read(PATIENCE_S) is None:
                            pass
                    with pytest.raises(LinkLost):
                        opened.get_feature(0x01)
                    with pytest.raises(LinkLost):
                        opened.send_feature(b"\x04\0\0\0\0")
                opened.close()
                listed(transport, SERIALS - {info.serial})
                with pytest.raises(TrackerNotFound, match="not there any more"):
                    transport.open(info)
                bed.plug()
            assert (our_threads(), open_files()) == ([], files)

        def test_a_dongle_with_nothing_behind_it_refuses_and_stays_open(
            self, bed: RemoteBed, transport: Transport
        ) -> None:
            with closing(transport.open(info_of(transport, "DONGLE"))) as opened:
                for _ in range(3):
                    with pytest.raises(
                        NoAnswer, match=r"Watchman dongle DONGLE: feature report 10"
                    ):
                        download_config(opened)
                assert ask_ranges(opened) is None
                assert ask_version(opened) is None
                assert opened.read(0.01) is None
                bed.put(b"\x26", number=SILENT_DONGLE)
                report = opened.read(PATIENCE_S)
                assert report is not None and report.data == b"\x26"

        @pytest.mark.parametrize(
            ("fault", "value"), [("config_pieces", 5), ("garbled", True), ("longest", 9)]
        )
        def test_half_a_configuration_noise_and_short_answers_are_told_and_the_rest_goes_on(
            self,
            bed: RemoteBed,
            transport: Transport,
            script: list[ScriptedDevice],
            fault: str,
            value: object,
        ) -> None:
            with closing(opened_cable(transport)) as opened:
                bed.fault(fault, value)
                with pytest.raises(FileFormatError, match="the device's configuration is"):
                    download_config(opened)
                assert read_all(bed, opened, 20) == by_interface(script[BY_CABLE], 20)

        def test_refused_commands_are_told_and_the_rest_goes_on(
            self, bed: RemoteBed, transport: Transport, script: list[ScriptedDevice]
        ) -> None:
            with closing(opened_cable(transport)) as opened:
                bed.fault("stalled", [0x04])
                with pytest.raises(NoAnswer, match="feature report 04"):
                    start_reports(opened, gen2=False)
                assert read_all(bed, opened, 20) == by_interface(script[BY_CABLE], 20)

        def test_reports_of_any_length_come_as_they_are(
            self, bed: RemoteBed, transport: Transport
        ) -> None:
            with closing(opened_cable(transport)) as opened:
                for data in (b"\x00", b"\xff" * 64, b"\x20\x01"):
                    bed.put(data, interface=2)
                    report = opened.read(PATIENCE_S)
                    assert report is not None
                    assert (report.interface, report.data) == (2, data)

        def test_a_device_that_may_not_be_opened_names_the_command(
            self, bed: RemoteBed, transport: Transport
        ) -> None:
            if not is_root():
                pytest.skip("run this test as root: it starts a program as another user")
            let_nobody_look()
            told = subprocess.run(
                [sys.executable, "-c", AS_NOBODY, transport.name],
                capture_output=True,
                text=True,
                check=True,
            ).stdout.splitlines()
            assert len(told) == 3
            for line in told:
                assert line.startswith("DriverUnavailable no permission for ")
                assert "lobstr-devices --install-udev-rules" in line
            opened_cable(transport).close()

    @pytest.mark.bed
    def test_an_endpoint_that_stalls_is_made_to_go_on(
        bed: RemoteBed, script: list[ScriptedDevice]
    ) -> None:
        with closing(
            opened_cable(TRANSPORTS[-1])
        ) as opened:  # the kernel and hidapi do it for the others
            bed.halt(0x81)
            assert read_all(bed, opened, 40) == by_interface(script[BY_CABLE], 40)

else:

    @pytest.mark.bed
    def test_devices_on_usb_are_read_and_lost_and_found(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        for module in ("hidraw", "usb"):
            present = importlib.util.find_spec(module) is not None
            need(f"the Python package of {module}", "pip install 'lobstr-hw[lighthouse]'", present)
        libusb = ctypes.util.find_library("usb-1.0")
        need("libusb", "apt-get install libusb-1.0-0", libusb is not None)
        script = tmp_path / "script.json"
        save_script(made_up_devices(), script)
        monkeypatch.setenv(SCRIPT, str(script))
        run_in_bed("lighthouse_testbed.py", [str(script)], Path(__file__))
