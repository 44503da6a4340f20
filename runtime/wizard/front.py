"""The wizard in front of a person: screen, keyboard, bell and voice."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from types import TracebackType
from typing import Self

from lobstr_hw.runtime.announcer import RANK, Announcer, Spoken
from lobstr_hw.runtime.live_line import LiveLine
from lobstr_hw.runtime.wizard.keyboard import Keyboard
from lobstr_hw.runtime.wizard.screen import draw
from lobstr_hw.runtime.wizard.view import View

__all__ = ["PersonFront"]


class PersonFront:
    """``with PersonFront(...) as front``: a live panel on stderr where that is a terminal."""

    def __init__(self, *, speech: bool, terminal: bool, tell: Callable[[str], None]) -> None:
        """Choose how to speak to the person.

        Args:
            speech: use the system's voice.
            terminal: draw and ring; otherwise every sentence becomes a line.
            tell: prints a line.
        """
        self._announcer = Announcer(speech=speech)
        self._keyboard = Keyboard()
        self._lines = LiveLine(lambda: self._view, draw, quiet=not terminal)
        self._tell = None if terminal else tell
        self._view: View | None = None
        self._heard = ""
        self._open = ExitStack()

    def __enter__(self) -> Self:
        """Open all of them."""
        with self._open:
            for part in (self._announcer, self._keyboard, self._lines):
                self._open.enter_context(part)
            self._open = self._open.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the terminal as it was."""
        self._open.close()

    def keys(self) -> str:
        """Keys pressed since the last call."""
        return self._keyboard.read()

    def show(self, view: View) -> None:
        """Put this on the screen at its next turn."""
        self._view = replace(view, heard=self._heard)

    def say(self, spoken: Sequence[Spoken]) -> None:
        """Ring and speak, all of one turn in one breath; print where nobody sees a screen."""
        if not spoken:
            return
        self._heard = " ".join(one.text for one in spoken)
        self._announcer.say(Spoken(self._heard, max((s.sound for s in spoken), key=RANK.index)))
        if self._tell is not None:
            self._tell(self._heard)
