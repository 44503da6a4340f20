"""A Polhemus LIBERTY on USB, behind the real pyusb and libusb: a device made by umockdev.

The first run of this file has one test, which runs the file again in the bed, with the rest.
"""

import importlib.util
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.beds import need
from support.fake_polhemus import FakePolhemus, source_position
from support.stream_contract import Sent, StreamDriverContract
from support.umockdev_beds import run_in_bed
from support.usb_testbed import ENVIRONMENT, FAMILY

from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.magnetic import source_axes
from lobstr_hw.drivers.polhemus import PolhemusDriver
from lobstr_hw.drivers.polhemus_records import PolhemusModel
from lobstr_hw.errors import TrackerNotFound

IDENTITY = "0f44:ff20"


class UsbPolhemus(FakePolhemus):
    """Its line is the bed's socket."""

    def plug(self) -> None:
        line = socket.socket(FAMILY)
        line.connect(os.environ[ENVIRONMENT])
        assert line.recv(1) == b"\0", "the bed says that the device is in"
        descriptor = line.detach()
        self.begin(descriptor, [descriptor])


class UsbBed:
    has_line, has_clock, on_opening = True, True, 2
    serials = frozenset({"POLHEMUS-1", "POLHEMUS-2"})

    def __init__(self, folder: Path) -> None:
        self.device = UsbPolhemus(folder, PolhemusModel.LIBERTY)

    def make(self) -> TrackerDriver:
        return PolhemusDriver(model=PolhemusModel.LIBERTY)

    def send(self, frames: int) -> list[Sent]:
        R = source_axes("-z")
        return [
            (f"POLHEMUS-{station}", time_s, R @ source_position(station, time_s) * 0.0254)
            for station, time_s in self.device.advance(frames)
        ]

    def cut(self) -> None:
        self.device.cut()

    def restore(self) -> None:
        self.device.plug()


if ENVIRONMENT in os.environ:

    @pytest.mark.bed
    class TestPolhemusOnUsbContract(StreamDriverContract):
        @pytest.fixture
        def bed(self, tmp_path: Path) -> Iterator[UsbBed]:
            bed = UsbBed(tmp_path)
            yield bed
            bed.cut()

        def test_another_model_is_not_taken_for_it(self, bed: UsbBed) -> None:
            with pytest.raises(TrackerNotFound, match=r"no Polhemus PATRIOT on USB .*0f44:ef12"):
                PolhemusDriver(model=PolhemusModel.PATRIOT).open()

else:

    @pytest.mark.bed
    def test_the_contract_holds_on_a_usb_device() -> None:
        for module in ("usb", "serial"):
            present = importlib.util.find_spec(module) is not None
            need(f"the Python package of {module}", "pip install 'lobstr-hw[hid]'", present)
        run_in_bed("usb_testbed.py", [IDENTITY], Path(__file__))
