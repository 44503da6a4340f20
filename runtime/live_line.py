"""A few lines on the terminal, drawn anew a few times a second by a thread of their own.

Whoever works only leaves a snapshot behind; drawing costs about 3 ms of the interpreter's time.
"""

import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Generic, Self, TypeVar

from rich.console import Console, RenderableType
from rich.live import Live

__all__ = ["LiveLine"]

REFRESH_S = 0.25

Snapshot = TypeVar("Snapshot")


class LiveLine(Generic[Snapshot]):
    """Draws the newest snapshot until it is left; draws nothing where stderr is no terminal."""

    def __init__(
        self,
        snapshot: Callable[[], Snapshot | None],
        render: Callable[[Snapshot, Snapshot | None], RenderableType],
        quiet: bool = False,
    ) -> None:
        """Choose what to draw.

        Args:
            snapshot: gives the newest; called from another thread.
            render: makes lines of it and of the one drawn before.
            quiet: draw nothing.
        """
        self._snapshot, self._render = snapshot, render
        self._quiet = quiet or not sys.stderr.isatty()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._draw, name="status", daemon=True)

    def __enter__(self) -> Self:
        """Begin to draw."""
        if not self._quiet:
            self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Draw once more, and stop."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    def _draw(self) -> None:
        before: Snapshot | None = None
        with Live(console=Console(stderr=True), auto_refresh=False) as live:
            while True:
                ended = self._end.wait(REFRESH_S)
                now = self._snapshot()
                if now is not None:
                    live.update(self._render(now, before), refresh=True)
                    before = now
                if ended:
                    return
