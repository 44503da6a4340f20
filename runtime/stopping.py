"""Ending cleanly on Ctrl-C, SIGTERM and Ctrl-Break: a handler only sets a flag."""

import signal
from types import FrameType, TracebackType
from typing import Self

__all__ = ["StopRequest"]

SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGBREAK") if hasattr(signal, name)
]


class StopRequest:
    """``with StopRequest() as stop:`` - ``stop()`` is True once the user asked for the end.

    The second request has the signal's usual effect, so that a hung program can still be stopped.
    """

    def __init__(self) -> None:
        """Not asked yet."""
        self.asked = False
        self._before: dict[int, object] = {}

    def __call__(self) -> bool:
        """Whether the end was asked for."""
        return self.asked

    def __enter__(self) -> Self:
        """Take over the signals; main thread only."""
        for number in SIGNALS:
            self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the signals back."""
        self._restore()

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        self._restore()

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)  # type: ignore[arg-type]
        self._before.clear()
