"""A scripted USB device in a test bed, and what wakes those who wait for it."""

import errno
import os
import struct
import termios
import threading
import tty
from collections import deque

from support.bed_records import descriptors
from support.scripted_usb import FeatureAnswers, ScriptedDevice

__all__ = ["BedDevice", "Gate"]


class Gate:
    """A pseudo-terminal in the place of a usbfs file, which libusb polls for being writable.

    It is while output to it is not stopped (as by Ctrl-S): so poll() wakes when something can be
    reaped, as with the kernel's, and not all the time.
    """

    def __init__(self, node: str) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self._open = True
        os.unlink(node)
        os.symlink(os.ttyname(self._slave), node)

    def set(self, open_: bool) -> None:
        if open_ != self._open:
            self._open = open_
            termios.tcflow(self._slave, termios.TCOON if open_ else termios.TCOOFF)


class BedDevice:
    """A device from one plugging in to the next: what is let go and not fetched yet."""

    def __init__(self, script: ScriptedDevice, lines: list[tuple[int, int]], gate: Gate) -> None:
        """Plugged in.

        Args:
            script: what it answers and sends.
            lines: both ends of what stands behind each hidraw file: a byte in it wakes poll.
            gate: stands behind its usbfs file.
        """
        self.script = script
        self.answers = FeatureAnswers(script.features)
        self.lock = threading.Lock()
        self.plugged = True
        self.halted: set[int] = set()
        self.let_go = 0
        self.queues: list[deque[bytes]] = [deque() for _ in script.ends]
        self._lines, self.gate = lines, gate

    def unplug(self) -> None:
        with self.lock:
            self.plugged = False
            for writer, _ in self._lines:
                os.write(writer, b"x")
            self.gate.set(True)

    def play(self, count: int) -> None:
        """Let go of so many more reports."""
        for _, interface, data in self.script.reports[self.let_go : self.let_go + count]:
            self.put(interface, data)
        self.let_go = min(self.let_go + count, len(self.script.reports))

    def put(self, interface: int, data: bytes) -> None:
        with self.lock:
            if not self.queues[interface]:
                os.write(self._lines[interface][0], b"x")
            self.queues[interface].append(data)
            self.gate.set(True)

    def take(self, interface: int) -> bytes | None:
        with self.lock:
            queue = self.queues[interface]
            if not queue:
                return None
            data = queue.popleft()
            if not queue:
                os.read(self._lines[interface][1], 1)
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
