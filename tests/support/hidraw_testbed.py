"""A dongle as /dev/hidraw0 under umockdev; run by the system's Python, which has gi.

    /usr/bin/python3 hidraw_testbed.py COMMAND...

The command runs with the device in sight, and steers it through the socket that LOBSTR_DONGLE names
(RemoteDongle). Its exit status is passed on.
"""

import json
import os
import queue
import socket
import struct
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

__all__ = ["RemoteDongle"]

ENVIRONMENT = "LOBSTR_DONGLE"
DEVICE = "/devices/pci0000:00/0000:00:14.0/usb1/1-1"
NODE = "/dev/hidraw0"
ENODEV, EPIPE = 19, 32
DESCRIPTOR = bytes.fromhex("0600ff0901a101150026ff0075089540090181020901b102c0")
"""Vendor-defined: 64 bytes in, a feature report of 64 bytes, no report numbers."""

if sys.platform == "win32":
    FAMILY = socket.AF_INET  # never used: for the type checker, which knows no AF_UNIX there
else:
    FAMILY = socket.AF_UNIX


class RemoteDongle:
    """A FakeDongle in the test bed's process, for the program that runs in it."""

    def __init__(self, path: str) -> None:
        self._socket = socket.socket(FAMILY)
        self._socket.connect(path)
        self._lines = self._socket.makefile("rw", encoding="utf-8")

    def _call(self, name: str, *args: str) -> list[str]:
        self._lines.write(json.dumps([name, *args]) + "\n")
        self._lines.flush()
        answer: list[str] = json.loads(self._lines.readline())
        return answer

    def put(self, report: bytes) -> None:
        """Send an input report."""
        self._call("put", report.hex())

    def sent(self) -> list[bytes]:
        """What was written to it."""
        return [bytes.fromhex(text) for text in self._call("sent")]

    def unplug(self) -> None:
        """Gone."""
        self._call("unplug")

    def plug(self) -> None:
        """Back."""
        self._call("plug")

    def close(self) -> None:
        """Let go of the bed."""
        self._lines.close()
        self._socket.close()


def _records(vendor: int, product: int) -> list[str]:
    """The device and its three parents, as the kernel shows them."""
    hid = f"{DEVICE}/1-1:1.0/0003:{vendor:04X}:{product:04X}.0001"
    return [
        f"P: {DEVICE}\nN: bus/usb/001/002\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\n"
        "E: DEVNAME=/dev/bus/usb/001/002\nE: BUSNUM=001\nE: DEVNUM=002\nE: MAJOR=189\nE: MINOR=1\n"
        f"A: idVendor={vendor:04x}\\n\nA: idProduct={product:04x}\\n\nA: manufacturer=HTC\\n\n"
        "A: product=Dongle\\n\nA: serial=0\\n\nA: bcdDevice=0100\\n\n"
        "A: busnum=1\\n\nA: devnum=2\\n\n",
        f"P: {DEVICE}/1-1:1.0\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\n"
        "A: bInterfaceNumber=00\\n\nA: bInterfaceClass=03\\n\n",
        f"P: {hid}\nE: SUBSYSTEM=hid\nE: HID_ID=0003:{vendor:08X}:{product:08X}\n"
        "E: HID_NAME=HTC Dongle\nE: HID_PHYS=usb-0000:00:14.0-1/input0\nE: HID_UNIQ=0\n"
        f"A: uevent=DRIVER=hid-generic\\nHID_ID=0003:{vendor:08X}:{product:08X}\\n"
        "HID_NAME=HTC Dongle\\nHID_UNIQ=0\\n\n"
        f"H: report_descriptor={DESCRIPTOR.hex().upper()}\n",
        f"P: {hid}/hidraw/hidraw0\nN: hidraw0\nE: SUBSYSTEM=hidraw\nE: DEVNAME={NODE}\n"
        f"E: MAJOR=245\nE: MINOR=0\nL: device=../../../{hid.rsplit('/', 1)[1]}\n",
    ]


def main(command: list[str]) -> int:
    """Set the bed up, run the command in it, take it down."""
    if sys.platform == "win32":
        raise NotImplementedError
    import gi  # type: ignore[import-not-found]

    gi.require_version("UMockdev", "1.0")
    from gi.repository import GLib, UMockdev  # type: ignore[import-not-found]

    sys.path.insert(0, str(Path(__file__).parent))
    from fake_dongle import PRODUCT, VENDOR, FakeDongle  # type: ignore[import-not-found]

    bed, dongle = UMockdev.Testbed.new(), FakeDongle()
    for record in _records(VENDOR, PRODUCT):
        bed.add_from_string(record)

    class Handler(UMockdev.IoctlBase):  # type: ignore[misc]
        """The node's ioctl, read and write."""

        def do_handle_ioctl(self, client: Any) -> bool:
            """Hidraw's requests; one that is not known is left to umockdev."""
            request = client.get_request()
            size, kind, number = request >> 16 & 0x3FFF, request >> 8 & 0xFF, request & 0xFF
            if kind != ord("H"):
                return False
            if not dongle.plugged:
                client.complete(-1, ENODEV)
                return True
            data = client.get_arg().resolve(0, size)
            match number:
                case 1:
                    data.update(0, list(struct.pack("<i", len(DESCRIPTOR))))
                    client.complete(0, 0)
                case 2:
                    data.update(4, list(DESCRIPTOR))
                    client.complete(0, 0)
                case 3:
                    data.update(0, list(struct.pack("<IHH", 3, VENDOR, PRODUCT)))
                    client.complete(0, 0)
                case 6:
                    dongle.set_feature(bytes(data.retrieve()))
                    client.complete(size, 0)
                case 7:
                    answer = dongle.get_feature()[:size]
                    data.update(0, list(answer))
                    client.complete(len(answer), 0)
                case _:
                    client.complete(-1, EPIPE)
            return True

        def do_handle_read(self, client: Any) -> bool:
            """One report, as a whole; the byte that announced it is taken out of the line."""
            try:
                os.read(reader, 1)
            except BlockingIOError:
                pass
            try:
                report = dongle.reports.get_nowait()
            except queue.Empty:
                client.complete(-1, ENODEV if not dongle.plugged else 11)
                return True
            client.get_arg().update(0, list(report))
            client.complete(len(report), 0)
            return True

    handler = Handler()
    bed.attach_ioctl(NODE, handler)
    line = bed.get_dev_fd(NODE)  # poll() sees the pseudo-terminal behind the node: a byte wakes it
    node = os.path.join(bed.get_root_dir(), NODE.lstrip("/"))
    reader = os.open(node, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY)
    loop = GLib.MainLoop()
    threading.Thread(target=loop.run, daemon=True).start()

    def obey(call: list[str]) -> list[str]:
        match call:
            case ["put", report]:
                dongle.put(bytes.fromhex(report))
                os.write(line, b"x")
            case ["sent"]:
                return [report.hex() for report in dongle.sent()]
            case ["unplug"]:
                dongle.unplug()
                os.write(line, b"x")
            case ["plug"]:
                dongle.plug()
        return []

    def serve(server: socket.socket) -> None:
        while True:
            connection, _ = server.accept()
            lines = connection.makefile("rw", encoding="utf-8")
            for text in lines:
                lines.write(json.dumps(obey(json.loads(text))) + "\n")
                lines.flush()

    with tempfile.TemporaryDirectory() as folder, socket.socket(FAMILY) as server:
        path = os.path.join(folder, "dongle")
        server.bind(path)
        server.listen()
        threading.Thread(target=serve, args=(server,), daemon=True).start()
        environment = dict(os.environ)
        environment["LD_PRELOAD"] = "libumockdev-preload.so.0"
        environment["UMOCKDEV_DIR"] = bed.get_root_dir()
        environment[ENVIRONMENT] = path
        status = subprocess.run(command, env=environment, timeout=120).returncode
    bed.detach_ioctl(NODE)
    loop.quit()
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
