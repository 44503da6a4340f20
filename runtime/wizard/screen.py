"""The wizard on a terminal: a view as lines of text and bars."""

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from lobstr_hw.runtime.wizard.view import Bar, DeviceRow, View

__all__ = ["draw"]

BAR_WIDTH = 24
PROGRESS_WIDTH = 40


def draw(view: View, before: View | None = None) -> RenderableType:
    """One screenful; ``before`` is not needed (the form is that of LiveLine)."""
    parts: list[RenderableType] = [Text(view.instruction, "bold")]
    if view.countdown_s is not None:
        parts.append(Text(f"begins in {view.countdown_s:.0f} s; a trigger press begins now"))
    if view.devices:
        parts.append(_devices(view.devices))
    if view.bars:
        parts.append(_bars(view.bars))
    if view.progress is not None:
        parts.append(_progress(view.progress))
    parts.append(Text(view.advice or " ", "yellow"))
    if view.heard:
        parts.append(Text(f'"{view.heard}"', "italic"))
    step, steps = view.position
    return Panel(
        Group(*parts),
        title=f"{step}/{steps} {view.title}",
        title_align="left",
        subtitle=view.keys or None,
        subtitle_align="left",
        width=78,
    )


def _bars(bars: tuple[Bar, ...]) -> Table:
    grid = Table.grid(padding=(0, 2))
    for bar in bars:
        colour = "green" if bar.ok else "yellow" if bar.share > 0.25 else "red"
        grid.add_row(bar.name, _bar(bar.share, colour), "ok" if bar.ok else "--", bar.value)
    return grid


def _bar(share: float, colour: str) -> Text:
    """Filled up to the share; the stroke in the middle is the limit."""
    filled = round(min(max(share, 0.0), 1.0) * BAR_WIDTH)
    middle = BAR_WIDTH // 2
    text = Text()
    for i in range(BAR_WIDTH):
        if i == middle:
            text.append("|")
        text.append("#" if i < filled else ".", colour if i < filled else "dim")
    return text


def _progress(share: float) -> Text:
    filled = round(min(max(share, 0.0), 1.0) * PROGRESS_WIDTH)
    text = Text("=" * filled, "green")
    return text.append("-" * (PROGRESS_WIDTH - filled), "dim")


def _devices(rows: tuple[DeviceRow, ...]) -> Table:
    grid = Table.grid(padding=(0, 2))
    for row in rows:
        role = "nothing" if row.role is None else row.role.replace("_", " ")
        battery = "" if row.battery is None else f"battery {100.0 * row.battery:.0f} %"
        sight = Text("in sight", "green") if row.in_sight else Text("out of sight", "yellow")
        grid.add_row(f"{row.number}", Text(role, "bold"), row.kind, row.serial, sight, battery)
    return grid
