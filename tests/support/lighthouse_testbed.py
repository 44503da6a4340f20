"""Scripted USB devices as the kernel shows them; run by the system's Python, which has gi.

    /usr/bin/python3 lighthouse_testbed.py SCRIPT COMMAND...

The command runs with the devices in sight, each at once as a device of usbfs (for libusb) and as
device files of hidraw, and steers them through the socket that LOBSTR_USB_BED names (RemoteBed).
A device's reports wait until they are let go: so no library's queue runs over however slow it is.
"""

import errno
import json
import os
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from support.bed_records import HID_DESCRIPTOR, Place, descriptors, records
from support.scripted_usb import FeatureAnswers, ScriptedDevice, load_script

__all__ = ["ENVIRONMENT"]

ENVIRONMENT = "LOBSTR_USB_BED"
PRELOAD = "libumockdev-preload.so.0"
TIMEOUT_S = 1800
CONTROL = 2
CAPABILITIES = 0x35
HARMLESS = frozenset({4, 5, 15, 16, 18, 20, 21, 22, 23, 27})
"""Requests of usbfs: configuration, claims, resets: all are well."""
URB_BYTES = 56
IDLE_S = 0.0003
"""libusb waits for a file that is always ready here."""


class BedDevice:
    """A device: what is let go and not fetched yet, by interface; everything under one lock."""

    def __init__(self, script: ScriptedDevice) -> None:
        self.script = script
        self.answers = FeatureAnswers(script.features)
        self.lock = threading.Lock()
        self.plugged = False
        self.halted: set[int] = set()
        self.let_go = 0
        self.queues: list[deque[bytes]] = []
        self.lines: list[tuple[int, int]] = []

    def plug(self, lines: list[tuple[int, int]]) -> None:
        """``lines``: both ends of what stands behind each hidraw file: a byte in it wakes poll."""
        with self.lock:
            self.answers = FeatureAnswers(self.script.features)
            self.let_go, self.halted = 0, set()
            self.queues = [deque() for _ in self.script.ends]
            self.lines, self.plugged = lines, True

    def unplug(self) -> None:
        with self.lock:
            self.plugged = False
            for writer, _ in self.lines:
                os.write(writer, b"x")

    def play(self, count: int) -> None:
        """Let go of so many more reports."""
        for _, interface, data in self.script.reports[self.let_go : self.let_go + count]:
            self.put(interface, data)
        self.let_go = min(self.let_go + count, len(self.script.reports))

    def put(self, interface: int, data: bytes) -> None:
        with self.lock:
            if not self.queues[interface]:
                os.write(self.lines[interface][0], b"x")
            self.queues[interface].append(data)

    def take(self, interface: int) -> bytes | None:
        with self.lock:
            queue = self.queues[interface]
            if not queue:
                return None
            data = queue.popleft()
            if not queue:
                os.read(self.lines[interface][1], 1)
            return data

    def control(self, setup: bytes, data: bytes) -> tuple[int, bytes]:
        """A control transfer: status and what it gives."""
        kind, request, value, _, length = struct.unpack("<BBHHH", setup)
        if (kind, request) == (0x80, 6):
            answer = self._descriptor(value >> 8, value & 0xFF)
        elif (kind, request) == (0xA1, 1):
            answer = self.answers.get(value & 0xFF)
        elif (kind, request) == (0x21, 9):
            return (0, b"") if self.answers.set(data) else (-errno.EPIPE, b"")
        elif (kind, request) == (0x02, 1):
            self.halted.clear()
            answer = b""
        else:
            answer = None
        return (0, answer[:length]) if answer is not None else (-errno.EPIPE, b"")

    def _descriptor(self, kind: int, number: int) -> bytes | None:
        s = self.script
        device, whole = descriptors(s.vendor, s.product, s.ends)
        if kind == 3:
            text = ["", "Valve", s.name, s.serial][number].encode("utf-16le")
            return bytes([len(text) + 2, 3]) + text if number else struct.pack("<BBH", 4, 3, 0x409)
        return {1: device, 2: whole}.get(kind)


def identity(block: Any) -> bytes:
    """Tells a request block from others: its endpoint and where its buffer lies."""
    head = bytes(block.retrieve())
    return head[:2] + head[16:24]


class Transfer:
    """A request block of usbfs: type at 0, endpoint at 1, status at 4, buffer at 16, lengths."""

    def __init__(self, block: Any) -> None:
        self.block = block
        head = bytes(block.retrieve())
        self.identity = identity(block)
        self.kind, self.endpoint = head[0], head[1]
        (length,) = struct.unpack_from("<i", head, 24)
        self.buffer: Any = block.resolve(16, length) if length else None
        self.cancelled = False

    def try_finish(self, device: BedDevice) -> bool:
        """Whether it has come to an end, which is then written into it."""
        data = b""
        if not device.plugged:
            status = -errno.ENODEV
        elif self.cancelled:
            status = -errno.ENOENT
        elif self.kind == CONTROL:
            raw = bytes(self.buffer.retrieve())
            status, data = device.control(raw[:8], raw[8:])
            if data:
                self.buffer.update(8, list(data))
        elif self.endpoint in device.halted:
            status = -errno.EPIPE
        else:
            report = device.take(device.script.ends.index(self.endpoint))
            if report is None:
                return False
            status, data = 0, report
            self.buffer.update(0, list(data))
        self.block.update(4, list(struct.pack("<i", status)))
        self.block.update(28, list(struct.pack("<i", len(data))))
        return True


def usbfs_handler(base: Any, device: BedDevice) -> Any:
    """What answers the ioctls of a device's usbfs file."""
    pending: dict[Any, list[Transfer]] = {}  # each open file has its own

    def reap(client: Any, transfers: list[Transfer]) -> None:
        for transfer in transfers:
            if transfer.try_finish(device):
                transfers.remove(transfer)
                client.get_arg().resolve(0, 8).set_ptr(0, transfer.block)
                client.complete(0, 0)
                return
        time.sleep(IDLE_S)
        client.complete(-1, errno.EAGAIN)

    class Handler(base):  # type: ignore[misc]
        def do_handle_ioctl(self, client: Any) -> bool:
            request = client.get_request()
            size, kind, number = request >> 16 & 0x3FFF, request >> 8 & 0xFF, request & 0xFF
            if kind != ord("U"):
                return False
            transfers = pending.setdefault(client, [])
            if number == 26:
                client.get_arg().resolve(0, 4).update(0, list(struct.pack("<I", CAPABILITIES)))
                client.complete(0, 0)
            elif number in (12, 13):
                reap(client, transfers)
            elif number == 11:  # libusb gives up what it asked for
                given_up = identity(client.get_arg().resolve(0, URB_BYTES))
                for transfer in transfers:
                    transfer.cancelled |= transfer.identity == given_up
                client.complete(0, 0)
            elif number == 8:
                client.complete(-1, errno.ENODATA)
            elif not device.plugged:
                client.complete(-1, errno.ENODEV)
            elif number == 10:
                transfers.append(Transfer(client.get_arg().resolve(0, size)))
                client.complete(0, 0)
            elif number == 21:
                device.halted.clear()
                client.complete(0, 0)
            elif number in HARMLESS:
                client.complete(0, 0)
            else:
                return False
            return True

        def do_client_vanished(self, client: Any) -> None:
            pending.pop(client, None)

    return Handler()


def hidraw_handler(base: Any, device: BedDevice, interface: int) -> Any:
    """What answers the ioctls and reads of one of a device's hidraw files."""

    class Handler(base):  # type: ignore[misc]
        def do_handle_ioctl(self, client: Any) -> bool:
            request = client.get_request()
            size, kind, number = request >> 16 & 0x3FFF, request >> 8 & 0xFF, request & 0xFF
            if kind != ord("H"):
                return False
            if not device.plugged:
                client.complete(-1, errno.ENODEV)
                return True
            data = client.get_arg().resolve(0, size)
            s = device.script
            if number == 1:
                data.update(0, list(struct.pack("<i", len(HID_DESCRIPTOR))))
                client.complete(0, 0)
            elif number == 2:
                data.update(4, list(HID_DESCRIPTOR))
                client.complete(0, 0)
            elif number == 3:
                data.update(0, list(struct.pack("<IHH", 3, s.vendor, s.product)))
                client.complete(0, 0)
            elif number == 6:
                taken = device.answers.set(bytes(data.retrieve()))
                client.complete(*((size, 0) if taken else (-1, errno.EPIPE)))
            elif number == 7:
                answer = device.answers.get(bytes(data.retrieve())[0])
                if answer is None:
                    client.complete(-1, errno.EPIPE)
                else:
                    data.update(0, list(answer[:size]))
                    client.complete(len(answer[:size]), 0)
            else:
                client.complete(-1, errno.EPIPE)
            return True

        def do_handle_read(self, client: Any) -> bool:
            report = device.take(interface) if device.plugged else None
            if report is None:
                client.complete(-1, errno.EAGAIN if device.plugged else errno.ENODEV)
                return True
            client.get_arg().update(0, list(report))
            client.complete(len(report), 0)
            return True

    return Handler()


class Bus:
    """Plugs devices in and out; every time at a new address, as the kernel does it."""

    def __init__(self, umockdev: Any, devices: list[ScriptedDevice]) -> None:
        self._umockdev, self.bed = umockdev, umockdev.Testbed.new()
        self.devices = [BedDevice(script) for script in devices]
        self._handlers: list[Any] = []  # for ever: a lost device's files may be open still
        self._paths: dict[int, list[str]] = {}
        self._address, self._hidraw = 2, 0

    def plug(self, number: int) -> None:
        device = self.devices[number]
        place = Place(number + 1, self._address, self._hidraw)
        self._address, self._hidraw = self._address + 1, self._hidraw + len(device.script.ends)
        s = device.script
        lines_of_records = records(s.vendor, s.product, s.serial, s.name, s.ends, place)
        for record in lines_of_records:
            self.bed.add_from_string(record)
        self._paths[number] = [f"/sys{r.splitlines()[0][3:]}" for r in lines_of_records]
        self._attach(place.usb_node, usbfs_handler(self._umockdev.IoctlBase, device))
        lines = []
        for interface in range(len(s.ends)):
            node = place.hidraw_node(interface)
            self._attach(node, hidraw_handler(self._umockdev.IoctlBase, device, interface))
            path = os.path.join(self.bed.get_root_dir(), node[1:])
            reader = os.open(path, os.O_RDWR | os.O_NONBLOCK | getattr(os, "O_NOCTTY", 0))
            lines.append((self.bed.get_dev_fd(node), reader))
        device.plug(lines)
        self.bed.uevent(f"/sys{place.syspath}", "add")

    def unplug(self, number: int) -> None:
        paths = self._paths.pop(number, [])
        if paths:
            self.devices[number].unplug()
            self.bed.uevent(paths[0], "remove")  # of the device only: listeners keep but a few
        for path in reversed(paths):
            self.bed.remove_device(path)

    def _attach(self, node: str, handler: Any) -> None:
        self.bed.attach_ioctl(node, handler)
        self._handlers.append((node, handler))

    def detach(self) -> None:
        for node, _ in self._handlers:
            self.bed.detach_ioctl(node)

    def obey(self, call: list[Any]) -> Any:
        """One line of RemoteBed."""
        name, number, *rest = call
        device = self.devices[number]
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
    for number in range(len(bus.devices)):
        bus.plug(number)
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
