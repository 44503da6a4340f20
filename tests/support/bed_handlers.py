"""How the kernel answers for a device of a test bed: usbfs (libusb) and hidraw, for umockdev."""

import errno
import struct
from typing import Any

from support.bed_device import BedDevice
from support.bed_records import HID_DESCRIPTOR

__all__ = ["hidraw_handler", "usbfs_handler"]

CONTROL = 2
CAPABILITIES = 0x35
HARMLESS = frozenset({4, 5, 15, 16, 18, 20, 21, 22, 23, 27})
"""Requests of usbfs: configuration, claims, resets: all are well."""
URB_BYTES = 56


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

    def is_due(self, device: BedDevice) -> bool:
        """Whether it has come to an end."""
        if not device.plugged or self.cancelled or self.kind == CONTROL:
            return True
        waiting = device.queues[device.script.ends.index(self.endpoint)]
        return self.endpoint in device.halted or bool(waiting)

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
        with device.lock:
            if not any(t.is_due(device) for others in pending.values() for t in others):
                device.gate.set(False)
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
                device.gate.set(True)
                client.complete(0, 0)
            elif number == 8:
                client.complete(-1, errno.ENODATA)
            elif not device.plugged:
                client.complete(-1, errno.ENODEV)
            elif number == 10:
                transfers.append(Transfer(client.get_arg().resolve(0, size)))
                device.gate.set(True)
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
