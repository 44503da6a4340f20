"""What a person in a headset hears: a bell, and words where the system can speak.

A thread of its own does it, for starting a program takes milliseconds that the loop does not have.
"""

import queue
import subprocess
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from types import TracebackType
from typing import Self, TextIO

from lobstr_hw.runtime.speech import SpeechEngine, find_speech

__all__ = ["RANK", "Announcer", "Sound", "Spoken"]

LONGEST_S = 8.0
"""A voice that takes longer than this hangs."""
END_S = 4.0
"""The last words may take so long at the end of the program."""


class Sound(StrEnum):
    """What a message is to somebody who cannot see; each has its number of bells."""

    STEP = "step"
    DONE = "done"
    TROUBLE = "trouble"


RANK = (Sound.STEP, Sound.DONE, Sound.TROUBLE)
"""Of several at once, the last in this row counts."""
BELLS = {Sound.STEP: 1, Sound.DONE: 2, Sound.TROUBLE: 3}
BELL_GAP_S = 0.15


@dataclass(frozen=True, slots=True)
class Spoken:
    """A short sentence for the ear, and the kind of sound that goes with it."""

    text: str
    sound: Sound = Sound.STEP


class Announcer:
    """``with Announcer(...) as announcer: announcer.say(Spoken("Ready."))`` - returns at once.

    Words that are still waiting when newer ones come are left out: late words mislead. Their bells
    are not.
    """

    def __init__(
        self,
        *,
        speech: bool = True,
        bell: TextIO | None = None,
        engine: SpeechEngine | None = None,
    ) -> None:
        """Choose the voice.

        Args:
            speech: whether to speak at all.
            bell: where the bell rings; stderr if it is a terminal, when None.
            engine: speaks; found by itself when None.
        """
        self._engine = (engine or find_speech()) if speech else None
        terminal = sys.__stderr__ if sys.__stderr__ and sys.__stderr__.isatty() else None
        self._bell = bell or terminal
        self._queue: queue.SimpleQueue[Spoken | None] = queue.SimpleQueue()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="announcer", daemon=True)

    def say(self, spoken: Spoken) -> None:
        """Ring, and speak as soon as the sentence before is over."""
        self._queue.put(spoken)

    def __enter__(self) -> Self:
        """Start the thread."""
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let it finish the newest words."""
        self._queue.put(None)
        self._thread.join(END_S)
        self._end.set()

    def _run(self) -> None:
        while True:
            waiting = [self._queue.get()]
            with suppress(queue.Empty):
                while True:
                    waiting.append(self._queue.get_nowait())
            messages = [spoken for spoken in waiting if spoken is not None]
            for spoken in messages:
                self._ring(spoken.sound)
            if messages:
                self._speak(messages[-1].text)
            if None in waiting:
                return

    def _ring(self, sound: Sound) -> None:
        if self._bell is None:
            return
        for i in range(BELLS[sound]):
            if i:
                self._end.wait(BELL_GAP_S)
            with suppress(OSError, ValueError):  # a terminal that went away
                self._bell.write("\a")
                self._bell.flush()

    def _speak(self, text: str) -> None:
        if self._engine is None:
            return
        try:
            with self._engine.start(text) as process:
                try:
                    process.wait(LONGEST_S)
                except subprocess.TimeoutExpired:
                    process.kill()
        except OSError:
            self._engine = None  # it is there but does not run: bells only
