"""Making a whole log of one that was cut: what is on disk is kept, the index is made anew."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from lobstr_hw.drivers.tracker_log.container import RecordFile, copy_compressed

__all__ = ["Repaired", "repair_log"]


@dataclass(frozen=True, slots=True)
class Repaired:
    """What became of a log: messages kept, and why the old file ended early ("" if it did not)."""

    messages: int
    damage: str


def repair_log(
    source: str | Path, target: str | Path, progress: Callable[[int], None] | None = None
) -> Repaired:
    """Write every whole message of ``source`` into a new, compressed file.

    Raises:
        LogFileError: no such file, or not MCAP.
        OSError: the target cannot be written.
    """
    file = RecordFile(Path(source))
    messages = copy_compressed(file, Path(target), progress)
    return Repaired(messages, file.damage)
