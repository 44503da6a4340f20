"""Scripted USB devices as the kernel shows them; run by the system's Python, which has gi.

    /usr/bin/python3 lighthouse_testbed.py SCRIPT COMMAND...

The command runs with the devices in sight, each at once as a device of usbfs (for libusb) and as
device files of hidraw, and steers them through the socket that LOBSTR_USB_BED names (RemoteBed).
A device's reports wait until they are let go: so no library's queue runs over however slow it is.
"""

import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from support.bed_device import BedDevice, Gate
from support.bed_handlers import hidraw_handler, usbfs_handler
from support.bed_records import Place, records
from support.scripted_usb import ScriptedDevice, load_script

__all__ = ["ENVIRONMENT"]

ENVIRONMENT = "LOBSTR_USB_BED"
PRELOAD = "libumockdev-preload.so.0"
TIMEOUT_S = 1800


def _opened(path: str) -> int:
    return os.open(path, os.O_RDWR | os.O_NONBLOCK | getattr(os, "O_NOCTTY", 0))


class Bus:
    """Plugs devices in and out; every time at a new address, as the kernel does it."""

    def __init__(self, umockdev: Any, scripts: list[ScriptedDevice]) -> None:
        self._umockdev, self.bed = umockdev, umockdev.Testbed.new()
        self._scripts = scripts
        self._devices: dict[int, BedDevice] = {}
        self._paths: dict[int, list[str]] = {}
        self._handlers: list[Any] = []  # for ever: a lost device's files may be open still
        self._address, self._hidraw = 2, 0
        for number in range(len(scripts)):
            self.plug(number)

    def plug(self, number: int) -> None:
        s = self._scripts[number]
        place = Place(number + 1, self._address, self._hidraw)
        self._address, self._hidraw = self._address + 1, self._hidraw + len(s.ends)
        lines_of_records = records(s.vendor, s.product, s.serial, s.name, s.ends, place)
        for record in lines_of_records:
            self.bed.add_from_string(record)
        self._paths[number] = [f"/sys{r.splitlines()[0][3:]}" for r in lines_of_records]
        hidraws = [place.hidraw_node(interface) for interface in range(len(s.ends))]
        lines = [(self.bed.get_dev_fd(node), _opened(self._file(node))) for node in hidraws]
        device = BedDevice(s, lines, Gate(self._file(place.usb_node)))
        base = self._umockdev.IoctlBase
        self._attach(place.usb_node, usbfs_handler(base, device))
        for interface, node in enumerate(hidraws):
            self._attach(node, hidraw_handler(base, device, interface))
        self._devices[number] = device
        self.bed.uevent(f"/sys{place.syspath}", "add")

    def unplug(self, number: int) -> None:
        paths = self._paths.pop(number, [])
        if not paths:
            return
        self._devices[number].unplug()
        self.bed.uevent(paths[0], "remove")  # of the device only: listeners keep but a few
        for path in reversed(paths):
            self.bed.remove_device(path)
        # its device files stay, and give ENODEV: umockdev leaks at the opening of missing ones

    def _file(self, node: str) -> str:
        return os.path.join(self.bed.get_root_dir(), node[1:])

    def _attach(self, node: str, handler: Any) -> None:
        self.bed.attach_ioctl(node, handler)
        self._handlers.append((node, handler))

    def detach(self) -> None:
        for node, _ in self._handlers:
            self.bed.detach_ioctl(node)

    def obey(self, call: list[Any]) -> Any:
        """One line of RemoteBed."""
        name, number, *rest = call
        device = self._devices[number]
        if name in ("plug", "unplug"):
            getattr(self, name)(number)
        elif name == "play":
            device.play(*rest)
        elif name == "put":
            device.put(rest[0], bytes.fromhex(rest[1]))
        elif name == "fault":
            value = set(rest[1]) if rest[0] == "stalled" else rest[1]
            setattr(device.answers, rest[0], value)
        elif name == "halt":
            device.halted = set(rest[0])
        elif name == "sent":
            return [data.hex() for data in device.answers.sent]
        elif name == "waiting":
            return sum(len(queue) for queue in device.queues)
        else:
            raise ValueError(name)
        return None


def serve(server: socket.socket, bus: Bus) -> None:
    """Obey one client after the other."""
    while True:
        connection, _ = server.accept()
        lines = connection.makefile("rw", encoding="utf-8")
        for text in lines:
            lines.write(json.dumps(bus.obey(json.loads(text))) + "\n")
            lines.flush()


def main(script: str, command: list[str]) -> int:
    """Set the bed up, run the command in it, take it down."""
    import gi  # type: ignore[import-not-found]

    gi.require_version("UMockdev", "1.0")
    from gi.repository import GLib, UMockdev  # type: ignore[import-not-found]

    bus = Bus(UMockdev, load_script(Path(script)))
    loop = GLib.MainLoop()
    threading.Thread(target=loop.run, daemon=True).start()
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as server:
        path = os.path.join(folder, "bed")
        server.bind(path)
        server.listen()
        threading.Thread(target=serve, args=(server, bus), daemon=True).start()
        environment = dict(os.environ)
        environment["LD_PRELOAD"] = PRELOAD
        environment["UMOCKDEV_DIR"] = bus.bed.get_root_dir()
        environment[ENVIRONMENT] = path
        status = subprocess.run(command, env=environment, timeout=TIMEOUT_S).returncode
    bus.detach()
    loop.quit()
    return status


if __name__ == "__main__":
    if "LD_PRELOAD" not in os.environ:  # telling of devices that come and go needs it here, too
        os.environ["LD_PRELOAD"] = PRELOAD
        os.execv(sys.executable, [sys.executable, *sys.argv])
    sys.exit(main(sys.argv[1], sys.argv[2:]))
