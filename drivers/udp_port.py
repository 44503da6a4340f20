"""An open UDP port."""

import errno
import socket
from contextlib import suppress

from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable

__all__ = ["UdpPort"]

READ_S = 0.05
DATAGRAM_BYTES = 65535
IN_USE = frozenset({errno.EADDRINUSE, getattr(errno, "WSAEADDRINUSE", errno.EADDRINUSE)})


class UdpPort:
    """Listens to one address of this machine."""

    def __init__(self, bind: str, port: int) -> None:
        """Claim the port.

        Raises:
            DeviceBusy: another program has it.
            DriverUnavailable: the address is not of this machine, or the port is not allowed.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(READ_S)
        try:
            self._socket.bind((bind, port))
        except OSError as error:
            self._socket.close()
            raise _translated(bind, port, error) from error

    def read(self) -> bytes:
        """One datagram, or nothing within 0.05 s."""
        try:
            return self._socket.recv(DATAGRAM_BYTES)
        except TimeoutError:
            return b""

    def close(self) -> None:
        """Free the port; never raises."""
        with suppress(OSError):
            self._socket.close()


def _translated(bind: str, port: int, error: OSError) -> DriverError:
    if error.errno in IN_USE:
        return DeviceBusy(f"UDP port {port} is in use by another program: close it, or use port=")
    return DriverUnavailable(
        f"cannot listen on {bind}:{port} ({error}): bind= must be an address of this machine"
    )
