"""The status line of a live session."""

from collections.abc import Callable
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from lobstr_hw.runtime.live_line import LiveLine
from lobstr_hw.skeleton_pose import SkeletonPose, Source

__all__ = ["Snapshot", "StatusLine", "render"]

COLOURS = {"ok": "green", "guessed": "yellow", "missing": "red"}


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """What the status line shows.

    Attributes:
        elapsed_s: session time since the first tick.
        total_s: how long the session will be, where that is known.
        frames: poses sent.
        wall_s: since the first tick, for the rate.
        calibrated: whether the user's sizes are known.
        overruns: ticks that took too long.
        backlog: frames waiting in the outputs' queues.
        gate_events: samples refused so far.
        pose: the newest.
    """

    elapsed_s: float
    total_s: float | None
    frames: int
    wall_s: float
    calibrated: bool
    overruns: int
    backlog: int
    gate_events: int
    pose: SkeletonPose


def render(now: Snapshot, before: Snapshot | None = None) -> RenderableType:
    """Two rows: progress, the rate since the snapshot before and trouble; then the trackers."""
    cells: list[RenderableType] = [_progress(now), _rate(now, before), _calibration(now)]
    cells += [_contacts(now.pose), _trouble(now)]
    if now.total_s is not None:
        share = min(now.elapsed_s / max(now.total_s, 1e-9), 1.0)
        cells.insert(0, ProgressBar(total=1.0, completed=share, width=16))
    grid = Table.grid(padding=(0, 2))
    for _ in cells:
        grid.add_column(no_wrap=True)
    grid.add_row(*cells)
    return Group(grid, _roles(now.pose))


def _progress(now: Snapshot) -> Text:
    total = "" if now.total_s is None else f"/{now.total_s:.0f}"
    return Text(f"{now.elapsed_s:.1f}{total} s")


def _rate(now: Snapshot, before: Snapshot | None) -> Text:
    frames = now.frames - (before.frames if before else 0)
    seconds = now.wall_s - (before.wall_s if before else 0.0)
    return Text(f"{frames / seconds:.0f} Hz" if seconds > 0.0 else "")


def _calibration(now: Snapshot) -> Text:
    if now.calibrated and (now.pose.source == Source.HELD).all():
        return Text("waiting for trackers", "yellow")
    if now.calibrated:
        return Text("calibrated", "green")
    return Text("waiting for a T-pose", "yellow")


def _roles(pose: SkeletonPose) -> Text:
    text = Text()
    for role, report in pose.roles.items():
        age = f"{1e3 * report.age_s:.0f} ms" if report.age_s < 10.0 else "-"
        text.append(f"{role.replace('_', ' ')} {age}  ", COLOURS.get(report.state, ""))
    return text


def _contacts(pose: SkeletonPose) -> Text:
    text = Text("feet ")
    for letter, contact, locked in zip("LR", pose.contact[0], pose.locked[0], strict=True):
        text.append(letter if contact else "-", "bold green" if locked else "")
    return text


def _trouble(now: Snapshot) -> Text:
    counts = {"late": now.overruns, "refused": now.gate_events, "queued": now.backlog}
    return Text("  ".join(f"{word} {n}" for word, n in counts.items() if n), "yellow")


class StatusLine(LiveLine[Snapshot]):
    """Draws the newest snapshot until it is left; draws nothing where stderr is no terminal."""

    def __init__(self, snapshot: Callable[[], Snapshot | None], quiet: bool = False) -> None:
        """Choose what to draw.

        Args:
            snapshot: gives the newest; called from another thread.
            quiet: draw nothing.
        """
        super().__init__(snapshot, render, quiet)
