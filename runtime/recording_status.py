"""The lines that ``lobstr-record`` draws while it records."""

from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from lobstr_hw.trackers import TrackerRole

__all__ = ["RecordingSnapshot", "TrackerLine", "render_recording", "size"]

LITTLE_S = 600.0
"""A disk that is full in ten minutes is worth a colour."""


@dataclass(frozen=True, slots=True)
class TrackerLine:
    """One tracker: its samples and drop-outs so far, and whether it sees itself now."""

    serial: str
    role: TrackerRole | None
    samples: int
    dropouts: int
    tracked: bool


@dataclass(frozen=True, slots=True)
class RecordingSnapshot:
    """What the lines show.

    Attributes:
        elapsed_s: since the beginning.
        wall_s: now, for rates.
        file_bytes: written so far.
        free_bytes: on that disk.
        late: polls that were not made in time.
        trackers: in the order of their first samples.
    """

    elapsed_s: float
    wall_s: float
    file_bytes: int
    free_bytes: int
    late: int
    trackers: tuple[TrackerLine, ...]


def render_recording(
    now: RecordingSnapshot, before: RecordingSnapshot | None = None
) -> RenderableType:
    """A line about the file, then one for each tracker with its rate since the snapshot before."""
    seconds = now.wall_s - (before.wall_s if before else now.wall_s)
    counts = {line.serial: line.samples for line in (before.trackers if before else ())}
    table = Table.grid(padding=(0, 2))
    for line in now.trackers:
        new = line.samples - counts.get(line.serial, line.samples)
        rate = Text(f"{new / seconds:.0f} Hz" if seconds > 0.0 else "- Hz", justify="right")
        table.add_row(
            Text((line.role or "no role").replace("_", " ")),
            Text(line.serial),
            rate if line.tracked else Text("lost", "yellow"),
            Text(f"drop-outs {line.dropouts}", "yellow" if line.dropouts else ""),
        )
    if not now.trackers:
        table.add_row(Text("no samples yet: switch the trackers on", "yellow"))
    return Group(_file(now), table)


def _file(now: RecordingSnapshot) -> Text:
    text = Text(f"recording {now.elapsed_s:.1f} s  {size(now.file_bytes)}  ")
    per_s = now.file_bytes / now.elapsed_s if now.elapsed_s > 1.0 else 0.0
    left_s = now.free_bytes / per_s if per_s else float("inf")
    hours = f", full in {_duration(left_s)}" if left_s < 100 * 3600 else ""
    text.append(f"free {size(now.free_bytes)}{hours}", "red" if left_s < LITTLE_S else "")
    if now.late:
        text.append(f"  late {now.late}", "yellow")
    return text


def _duration(seconds: float) -> str:
    minutes = int(seconds // 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"


def size(count: float) -> str:
    """Bytes as people read them: 1.5 MB."""
    for unit in ("B", "kB", "MB"):
        if count < 999.5:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.1f} GB"
