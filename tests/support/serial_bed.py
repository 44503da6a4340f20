"""A device at the far end of a pseudo-terminal, behind the real pyserial."""

import importlib.util
import os
import select
import sys
import threading
from pathlib import Path

from support.beds import need
from support.waiting import wait_until

__all__ = ["SerialDevice", "need_serial"]


def need_serial() -> None:
    """Skip, or fail in a build, without pseudo-terminals and pyserial."""
    need("a pseudo-terminal", "run this test on Linux or macOS", sys.platform != "win32")
    has_serial = importlib.util.find_spec("serial") is not None
    need("pyserial", "pip install 'lobstr-hw[hid]'", has_serial)


class SerialDevice:
    """Obeys what is written to it; ``path`` stays the same when it is plugged in again."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "tty-of-the-device"
        self.commands: list[bytes] = []
        self._lock = threading.RLock()
        self._master = -1
        self._thread: threading.Thread | None = None
        self.plug()

    def plug(self) -> None:
        """A new pseudo-terminal under the old name."""
        if sys.platform == "win32":
            raise NotImplementedError
        import pty
        import tty

        master, slave = pty.openpty()
        tty.setraw(slave)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(slave))
        self.begin(master, [master, slave])

    def begin(self, line: int, descriptors: list[int]) -> None:
        """Power on, and listen to a line; ``descriptors`` are closed by cutting it."""
        self._pipe = os.pipe()
        self._master, self._descriptors = line, [*self._pipe, *descriptors]
        self.power_on()
        self._thread = threading.Thread(target=self._listen, args=(line, self._pipe[0]))
        self._thread.start()

    def cut(self) -> None:
        """Pull the plug."""
        if self._thread is None:
            return
        os.write(self._pipe[1], b"x")
        self._thread.join()
        self._thread = None
        for descriptor in self._descriptors:
            os.close(descriptor)

    def send(self, data: bytes) -> None:
        """Put bytes on the line."""
        with self._lock:
            os.write(self._master, data)

    def settle(self) -> None:
        """Come back when everything that was written has been obeyed."""
        wait_until(lambda: not select.select([self._master], [], [], 0)[0], "the device has read")
        with self._lock:
            pass

    def power_on(self) -> None:
        """Forget what was set up."""

    def obey(self, data: bytes) -> bytes:
        """Do what is asked for; give back what is not a whole command yet."""
        raise NotImplementedError

    def _listen(self, master: int, pipe: int) -> None:
        rest = b""
        while True:
            ready, _, _ = select.select([master, pipe], [], [])
            if pipe in ready:
                return
            with self._lock:  # taken before reading: an empty line then means that all is obeyed
                rest = self.obey(rest + os.read(master, 4096))
