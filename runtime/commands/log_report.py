"""What the subcommands of ``lobstr-log`` share: their report, progress and whole files."""

import argparse
import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from lobstr_hw.drivers.tracker_log.container import replace_file
from lobstr_hw.errors import OutputError

__all__ = ["Report", "Step", "Subparsers", "progress_bar", "whole_file"]

Subparsers: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


@dataclass(frozen=True, slots=True)
class Report:
    """The outcome of a command: for people, and as JSON."""

    text: str
    document: dict[str, Any]


@contextlib.contextmanager
def progress_bar(what: str) -> Iterator["Step"]:
    """A bar on stderr while something long runs; gone when it ends, absent where no one looks."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as p:
        yield Step(p, p.add_task(what, total=None))


class Step:
    """Moves a progress bar."""

    def __init__(self, progress: Progress, task: Any) -> None:
        """Bind bar and task."""
        self._progress, self._task = progress, task

    def __call__(self, done: float, total: float | None = None, what: str | None = None) -> None:
        """So much is done, of so much, of this."""
        self._progress.update(self._task, completed=done, total=total, description=what)


@contextlib.contextmanager
def whole_file(target: Path) -> Iterator[Path]:
    """A file beside ``target`` that takes its place when all went well, and goes away otherwise.

    Raises:
        OutputError: there is no such folder.
    """
    if not target.parent.is_dir():
        raise OutputError(f"{target} cannot be written: make the folder {target.parent} first")
    part = target.with_name(target.name + ".part")
    try:
        yield part
        replace_file(part, target)
    finally:
        part.unlink(missing_ok=True)
