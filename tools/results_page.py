"""Where figures go: the sections of docs/results.md, each made anew by its own tool."""

from pathlib import Path

RESULTS = Path(__file__).parent.parent / "docs" / "results.md"


def write_section(text: str, path: Path = RESULTS) -> None:
    """Put a section in the place of the one with the same heading, or at the end of the page."""
    title = text.splitlines()[0]
    old = path.read_text(encoding="utf-8") if path.exists() else "# Results\n"
    before, found, rest = old.partition(title + "\n")
    _, more, after = rest.partition("\n## ") if found else ("", "", "")
    new = before.rstrip() + "\n\n" + text.rstrip() + "\n"
    path.write_text(new + ("\n## " + after if more else ""), encoding="utf-8", newline="\n")


def shown(path: Path) -> str:
    """Data set and below: where the data lies is everybody's own business."""
    return "/".join(path.parts[-2:]) if path.is_absolute() else path.as_posix()
