"""Text to speech with what the system brings along; nothing is installed for it."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass

__all__ = ["SpeechEngine", "find_speech"]

TEXT_VARIABLE = "LOBSTR_SAY"
_POWERSHELL = (
    "Add-Type -AssemblyName System.Speech; "
    f"(New-Object System.Speech.Synthesis.SpeechSynthesizer).Speak($env:{TEXT_VARIABLE})"
)
"""The text travels in a variable of the environment: nothing in it can become a command."""


@dataclass(frozen=True, slots=True)
class SpeechEngine:
    """A program that speaks.

    Attributes:
        name: of it.
        command: without the text.
        by_variable: the text goes into the environment instead of behind the command.
    """

    name: str
    command: tuple[str, ...]
    by_variable: bool = False

    def start(self, text: str) -> "subprocess.Popen[bytes]":
        """Begin to speak; whoever called waits for it, or does not.

        Raises:
            OSError: the program cannot be run.
        """
        environment = {**os.environ, TEXT_VARIABLE: text} if self.by_variable else None
        return subprocess.Popen(
            self.command if self.by_variable else (*self.command, text),
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )


_ENGINES = {
    "darwin": (SpeechEngine("say", ("say",)),),
    "win32": (
        SpeechEngine(
            "powershell", ("powershell", "-NoProfile", "-Command", _POWERSHELL), by_variable=True
        ),
    ),
}
_ELSEWHERE = (
    SpeechEngine("spd-say", ("spd-say", "--wait", "--")),
    SpeechEngine("espeak-ng", ("espeak-ng", "--")),
    SpeechEngine("espeak", ("espeak", "--")),
)


def find_speech(platform: str = sys.platform) -> SpeechEngine | None:
    """The first engine of this system that is there; None where it is silent."""
    engines = _ENGINES.get(platform, _ELSEWHERE)
    return next((engine for engine in engines if shutil.which(engine.command[0])), None)
