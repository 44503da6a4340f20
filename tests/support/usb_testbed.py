"""A bulk USB device under umockdev; run by the system's Python, which has gi.

    /usr/bin/python3 usb_testbed.py VENDOR:PRODUCT COMMAND...

The command runs with the device in sight. What is written to the device comes out of the socket
that LOBSTR_USB_LINE names, and what is put into it the device sends: the device's mind is with the
command. It is plugged in while somebody holds the socket.
"""

import os
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from typing import Any

__all__ = ["ENVIRONMENT", "FAMILY"]

ENVIRONMENT = "LOBSTR_USB_LINE"
NODE = "/dev/bus/usb/001/002"
ENOENT, EAGAIN, ENODEV, EPIPE, ENODATA = 2, 11, 19, 32, 61
CONTROL, BULK = 2, 3
BULK_OUT, BULK_IN = 0x02, 0x82
CAPABILITIES = 0x35
HARMLESS = frozenset({4, 5, 15, 16, 18, 20, 21, 22, 23, 27})
"""Configuration, claims, resets: all are well."""

if sys.platform == "win32":
    FAMILY = socket.AF_INET  # never used: for the type checker, which knows no AF_UNIX there
else:
    FAMILY = socket.AF_UNIX


def descriptors(vendor: int, product: int) -> tuple[bytes, bytes]:
    """Device and configuration: one vendor-defined interface with a bulk endpoint each way."""
    ends = b"".join(struct.pack("<BBBBHB", 7, 5, end, 2, 64, 0) for end in (BULK_OUT, BULK_IN))
    interface = struct.pack("<9B", 9, 4, 0, 0, 2, 0xFF, 0, 0, 0) + ends
    whole = struct.pack("<BBHBBBBB", 9, 2, 9 + len(interface), 1, 1, 0, 0x80, 50) + interface
    device = struct.pack(
        "<BBHBBBBHHHBBBB", 18, 1, 0x0200, 0xFF, 0, 0, 64, vendor, product, 0x0100, 0, 0, 0, 1
    )
    return device, whole


def record(vendor: int, product: int) -> str:
    """The device as the kernel shows it."""
    return (
        "P: /devices/pci0000:00/0000:00:14.0/usb1/1-1\nN: bus/usb/001/002\nE: SUBSYSTEM=usb\n"
        f"E: DEVTYPE=usb_device\nE: DEVNAME={NODE}\nE: BUSNUM=001\nE: DEVNUM=002\nE: MAJOR=189\n"
        f"E: MINOR=1\nA: idVendor={vendor:04x}\\n\nA: idProduct={product:04x}\\n\n"
        "A: bcdDevice=0100\\n\nA: busnum=1\\n\nA: devnum=2\\n\nA: speed=12\\n\n"
        "A: bConfigurationValue=1\\n\nA: bNumConfigurations=1\\n\n"
        f"H: descriptors={b''.join(descriptors(vendor, product)).hex().upper()}\n"
    )


class Line:
    """The socket, as the device's two endpoints."""

    def __init__(self, path: str) -> None:
        self._server = socket.socket(FAMILY)
        self._server.bind(path)
        self._server.listen()
        self._connection: socket.socket | None = None
        self._lock, self._data = threading.Lock(), b""
        threading.Thread(target=self._serve, daemon=True).start()

    @property
    def plugged(self) -> bool:
        return self._connection is not None

    def _serve(self) -> None:
        while True:
            connection, _ = self._server.accept()
            with self._lock:
                self._data, self._connection = b"", connection
            connection.sendall(b"\0")  # tells whoever plugs it in that it is in
            while data := connection.recv(4096):
                with self._lock:
                    self._data += data
            self._connection = None
            connection.close()

    def take(self, most: int) -> bytes:
        with self._lock:
            data, self._data = self._data[:most], self._data[most:]
        return data

    def write(self, data: bytes) -> None:
        connection = self._connection
        if connection is not None:
            connection.sendall(data)


class Transfer:
    """A request block of usbfs: type at 0, endpoint at 1, status at 4, buffer at 16, lengths."""

    def __init__(self, block: Any) -> None:
        self.block = block
        head = bytes(block.retrieve())
        self.kind, self.endpoint = head[0], head[1]
        (length,) = struct.unpack_from("<i", head, 24)
        self.buffer: Any = block.resolve(16, length) if length else None
        self.length = length
        self.cancelled = False

    def data(self) -> bytes:
        return bytes(self.buffer.retrieve()) if self.buffer is not None else b""

    def finish(self, status: int, count: int) -> None:
        self.block.update(4, list(struct.pack("<i", status)))
        self.block.update(28, list(struct.pack("<i", count)))


def main(identity: str, command: list[str]) -> int:
    """Set the bed up, run the command in it, take it down."""
    import gi  # type: ignore[import-not-found]

    gi.require_version("UMockdev", "1.0")
    from gi.repository import GLib, UMockdev  # type: ignore[import-not-found]

    vendor, product = (int(part, 16) for part in identity.split(":"))
    device, whole = descriptors(vendor, product)
    bed = UMockdev.Testbed.new()
    bed.add_from_string(record(vendor, product))
    folder = tempfile.TemporaryDirectory()
    line = Line(os.path.join(folder.name, "line"))
    pending: list[Transfer] = []

    def control(setup: bytes) -> tuple[int, bytes]:
        kind, request, value, _, length = struct.unpack("<BBHHH", setup)
        known = {1: device, 2: whole}.get(value >> 8)
        if (kind, request) != (0x80, 6) or known is None:
            return -EPIPE, b""
        return 0, known[:length]

    def done(transfer: Transfer) -> bool:
        """Whether it has come to an end, which is then written into it."""
        if not line.plugged:
            transfer.finish(-ENODEV, 0)
        elif transfer.cancelled:
            transfer.finish(-ENOENT, 0)
        elif transfer.kind == CONTROL:
            status, answer = control(transfer.data()[:8])
            if answer:
                transfer.buffer.update(8, list(answer))
            transfer.finish(status, len(answer))
        elif transfer.endpoint == BULK_OUT:
            line.write(transfer.data())
            transfer.finish(0, transfer.length)
        else:
            data = line.take(transfer.length)
            if not data:
                return False
            transfer.buffer.update(0, list(data))
            transfer.finish(0, len(data))
        return True

    def reap(client: Any) -> None:
        for transfer in pending:
            if done(transfer):
                pending.remove(transfer)
                client.get_arg().resolve(0, 8).set_ptr(0, transfer.block)
                client.complete(0, 0)
                return
        time.sleep(0.0003)  # libusb waits for a file that is always ready here
        client.complete(-1, EAGAIN)

    class Handler(UMockdev.IoctlBase):  # type: ignore[misc]
        """The node's ioctl."""

        def do_handle_ioctl(self, client: Any) -> bool:
            """Usbfs' requests."""
            request = client.get_request()
            size, kind, number = request >> 16 & 0x3FFF, request >> 8 & 0xFF, request & 0xFF
            if kind != ord("U"):
                return False
            if number == 26:
                client.get_arg().resolve(0, 4).update(0, list(struct.pack("<I", CAPABILITIES)))
                client.complete(0, 0)
            elif number in (12, 13):
                reap(client)
            elif number == 11:
                for transfer in pending:
                    transfer.cancelled = True
                client.complete(0, 0)
            elif number == 8:
                client.complete(-1, ENODATA)
            elif not line.plugged:
                client.complete(-1, ENODEV)
            elif number == 10:
                pending.append(Transfer(client.get_arg().resolve(0, size)))
                client.complete(0, 0)
            elif number in HARMLESS:
                client.complete(0, 0)
            else:
                return False
            return True

    handler = Handler()
    bed.attach_ioctl(NODE, handler)
    loop = GLib.MainLoop()
    threading.Thread(target=loop.run, daemon=True).start()
    environment = dict(os.environ)
    environment["LD_PRELOAD"] = "libumockdev-preload.so.0"
    environment["UMOCKDEV_DIR"] = bed.get_root_dir()
    environment[ENVIRONMENT] = os.path.join(folder.name, "line")
    with folder:
        status = subprocess.run(command, env=environment, timeout=120).returncode
    bed.detach_ioctl(NODE)
    loop.quit()
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
