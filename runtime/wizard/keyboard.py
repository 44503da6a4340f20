"""Single keys from the terminal, without waiting for any."""

import sys
from types import TracebackType
from typing import Self

__all__ = ["Keyboard"]


class Keyboard:
    """``with Keyboard() as keys: keys.read()`` - keys pressed since; none where nobody can type.

    While it is entered the terminal shows no keys; Ctrl-C keeps its meaning.
    """

    def __init__(self) -> None:
        """Look whether there is a terminal."""
        self._on = sys.stdin is not None and sys.stdin.isatty()
        self._before: object = None

    def __enter__(self) -> Self:
        """Take keys one by one."""
        if self._on and sys.platform != "win32":
            import termios
            import tty

            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the terminal back as it was."""
        if self._before is not None and sys.platform != "win32":
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)  # type: ignore[arg-type]
            self._before = None

    def read(self) -> str:
        """The keys since the last call, one character each."""
        if not self._on:
            return ""
        if sys.platform == "win32":
            import msvcrt

            keys = ""
            while msvcrt.kbhit():
                keys += msvcrt.getwch()
            return keys
        import os
        import select

        if not select.select([sys.stdin], [], [], 0.0)[0]:
            return ""
        data = os.read(sys.stdin.fileno(), 64)
        if not data:
            self._on = False  # nobody types any more
        return data.decode("utf-8", "ignore")
