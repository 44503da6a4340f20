"""A program in a pseudo-terminal: what it shows is kept, keys can be typed, signals sent."""

import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["Terminal", "in_terminal"]


class Terminal:
    """The far end of a pseudo-terminal that a program runs in."""

    def __init__(self, process: "subprocess.Popen[bytes]", fd: int) -> None:
        self.process = process
        self.shown = b""
        self.fd = fd

    @property
    def text(self) -> str:
        """All that was shown so far, escape sequences included."""
        return self.shown.decode("utf-8", "replace")

    def type(self, keys: str) -> None:
        """Press keys."""
        os.write(self.fd, keys.encode())

    def read(self, within_s: float) -> bool:
        """Take in what comes; False once the program has closed its end."""
        if not select.select([self.fd], [], [], within_s)[0]:
            return True
        try:
            data = os.read(self.fd, 65536)
        except OSError:  # Linux says EIO when the other end is closed
            return False
        self.shown += data
        return bool(data)

    def wait_for(self, words: str, within_s: float = 15.0) -> None:
        """Until the program shows these words."""
        end = time.perf_counter() + within_s
        while words not in self.text:
            assert time.perf_counter() < end, f"{words!r} not within {within_s} s:\n{self.text}"
            if not self.read(0.05):
                assert words in self.text, f"ended without {words!r}:\n{self.text}"

    def finish(self, within_s: float = 20.0) -> int:
        """Until the program ends; its exit code."""
        end = time.perf_counter() + within_s
        while self.read(0.05):
            assert time.perf_counter() < end, f"still running after {within_s} s:\n{self.text}"
        return self.process.wait(5.0)


@contextmanager
def in_terminal(
    command: Sequence[str],
    size: tuple[int, int] = (30, 100),
    environment: Mapping[str, str] | None = None,
    stdout: Path | None = None,
) -> Iterator[Terminal]:
    """Run a Python module's command line in a terminal of its own.

    Args:
        command: name of the module, then its arguments.
        size: rows, columns.
        environment: variables on top of this program's.
        stdout: a file that takes it instead of the terminal.
    """
    if sys.platform == "win32":
        raise NotImplementedError("Windows has no pseudo-terminals")
    import fcntl
    import pty
    import struct
    import termios

    far, near = pty.openpty()
    fcntl.ioctl(near, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
    variables = {**os.environ, "TERM": "xterm-256color", **(environment or {})}
    out = near if stdout is None else os.open(stdout, os.O_WRONLY | os.O_CREAT)
    process = subprocess.Popen(
        [sys.executable, "-c", _TAKE_THE_TERMINAL, *command],
        stdin=near,
        stdout=out,
        stderr=near,
        env=variables,
        start_new_session=True,
    )
    for fd in {near, out}:
        os.close(fd)
    try:
        yield Terminal(process, far)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        with suppress(OSError):
            os.close(far)


_TAKE_THE_TERMINAL = """
import fcntl, runpy, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)  # so that Ctrl-C in it reaches the program
sys.argv = sys.argv[1:]
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
"""
