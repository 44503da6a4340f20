"""A serial line, and records cut from a stream of bytes."""

import errno
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from lobstr_hw.drivers.reading_thread import LinkLost
from lobstr_hw.drivers.vendor import require_library
from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound

__all__ = ["SerialLink", "cut_records"]

READ_S = 0.05
BUSY = frozenset({errno.EBUSY, errno.EAGAIN})


Record = TypeVar("Record")


def cut_records(
    buffer: bytes, length: int, parse: Callable[[bytes], Record | None]
) -> tuple[list[Record], bytes]:
    """Find the records in a stream that may have lost bytes or got strange ones.

    Args:
        buffer: what came in, oldest byte first.
        length: of a record, in bytes.
        parse: gives None for bytes that are not a record.

    Returns:
        The records, and the bytes at the end that may begin the next one.
    """
    records, at = [], 0
    while len(buffer) - at >= length:
        record = parse(buffer[at : at + length])
        if record is None:
            at += 1  # out of step: try from the next byte on
        else:
            records.append(record)
            at += length
    return records, buffer[at:]


class SerialLink:
    """An open serial line of 8 data bits, no parity, one stop bit."""

    def __init__(self, port: str, baud: int) -> None:
        """Claim the port.

        Raises:
            TrackerNotFound: there is no such port.
            DeviceBusy: another program has it.
            DriverUnavailable: pyserial or the permission is missing.
        """
        serial = require_library("serial", "pyserial", "hid")
        try:
            self._line: Any = serial.Serial(
                port, baud, timeout=READ_S, write_timeout=1.0, exclusive=True
            )
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise _translated(port, error) from error

    def read(self) -> bytes:
        """What has come in; waits 0.05 s at most.

        Raises:
            LinkLost: the line is gone.
        """
        try:
            return bytes(self._line.read(max(1, self._line.in_waiting)))
        except (OSError, TypeError, AttributeError) as error:  # the latter: closed meanwhile
            raise LinkLost(str(error)) from error

    def write(self, data: bytes) -> None:
        """Send.

        Raises:
            LinkLost: the line is gone.
        """
        try:
            self._line.write(data)
        except OSError as error:
            raise LinkLost(str(error)) from error

    def set_rts(self, on: bool) -> None:
        """Drive the RTS wire, where there is one."""
        with suppress(OSError):  # a pseudo-terminal has no such wire and says ENOTTY
            self._line.rts = on

    def quiet(self) -> None:
        """Throw away what comes in until nothing does, half a second at most."""
        for _ in range(10):
            if not self.read():
                return

    def close(self) -> None:
        """Release the port; never raises."""
        with suppress(OSError):
            self._line.close()


def _translated(port: str, error: OSError | ValueError) -> DriverError:
    """Pyserial's errors in our words."""
    number, text = getattr(error, "errno", None), str(error)
    if number in BUSY or "lock" in text or "PermissionError" in text:  # the last: Windows
        return DeviceBusy(f"{port} is in use by another program ({text}): close that program")
    if number == errno.EACCES:
        return DriverUnavailable(
            f"no permission for {port}: sudo usermod -aG dialout $USER, then log in again"
        )
    return TrackerNotFound(f"{port} cannot be opened ({text}); ports here: {_ports()}")


def _ports() -> str:
    listing = require_library("serial.tools.list_ports", "pyserial", "hid")
    return ", ".join(sorted(port.device for port in listing.comports())) or "none"
