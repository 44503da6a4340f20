"""What a program really shows in a terminal, as plain text for the documentation.

    python tools/capture_terminal.py --when "Stand still" --when Movement -- \
        lobstr_hw.runtime.commands.calibrate --driver fake:script=calibrate --no-speech

Runs a module in a pseudo-terminal (Linux, macOS) and prints the screen as it stands a moment after
each of the words has appeared first, and at the end. Bells are counted.
"""

import argparse
import re
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from support.terminal_bed import Terminal, in_terminal

SETTLE_S = 0.6
"""So long after its words appeared a screen is taken: it is drawn a few times a second."""
TOKEN = re.compile(r"\x1b\[([?0-9;]*)([A-Za-z])|\x1b\][^\x07]*\x07|(.)", re.DOTALL)


class Screen:
    """A terminal that knows what rich's live display needs."""

    def __init__(self) -> None:
        self.lines = [""]
        self.row = self.column = self.bells = 0

    def feed(self, text: str) -> None:
        """Take in output."""
        for match in TOKEN.finditer(text):
            numbers, command, char = match.groups()
            if command:
                self._control(command, int(numbers) if numbers.isdigit() else None)
            elif char == "\a":
                self.bells += 1
            elif char == "\n":
                self.row += 1
                self._fill()
            elif char == "\r":
                self.column = 0
            elif char and char >= " ":
                self._put(char)

    def _fill(self) -> None:
        while self.row >= len(self.lines):
            self.lines.append("")

    def _control(self, command: str, number: int | None) -> None:
        if command == "A":
            self.row = max(0, self.row - (number or 1))
        elif command == "K":
            self.lines[self.row] = "" if number == 2 else self.lines[self.row][: self.column]
        elif command == "G":
            self.column = (number or 1) - 1

    def _put(self, char: str) -> None:
        line = self.lines[self.row].ljust(self.column)
        self.lines[self.row] = line[: self.column] + char + line[self.column + 1 :]
        self.column += 1

    @property
    def text(self) -> str:
        """What stands on it."""
        return "\n".join(line.rstrip() for line in self.lines).strip("\n")


def follow(terminal: Terminal, screen: Screen, seconds: float) -> bool:
    """Let the program go on; False when it has ended."""
    end = time.perf_counter() + seconds
    alive = True
    while alive and time.perf_counter() < end:
        seen = len(terminal.shown)
        alive = terminal.read(0.05)
        screen.feed(terminal.shown[seen:].decode("utf-8", "replace"))
    return alive


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--when", action="append", default=[], metavar="WORDS")
    parser.add_argument("--columns", type=int, default=100)
    parser.add_argument("command", nargs="+", metavar="MODULE ARGUMENT")
    args = parser.parse_args()
    screen, waiting = Screen(), list(args.when)
    with in_terminal(args.command, (80, args.columns)) as terminal:
        while follow(terminal, screen, 0.05):
            if waiting and waiting[0] in screen.text:
                follow(terminal, screen, SETTLE_S)
                print(f"--- {waiting.pop(0)}\n{screen.text}\n")
        code = terminal.process.wait(5.0)
    print(f"--- at the end (exit code {code}, {screen.bells} bells)\n{screen.text}")


if __name__ == "__main__":
    main()
