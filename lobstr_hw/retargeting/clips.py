"""Motion clips on disk: which there are, whose they are, and what is wrong with them."""

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from lobstr_hw.errors import FileFormatError

__all__ = ["ClipFile", "Fault", "find_clips", "own_faults", "read_faults"]


@dataclass(frozen=True, slots=True)
class ClipFile:
    """One clip.

    Attributes:
        path: of the BVH file.
        set_name: the folder it belongs to.
        clip: its name without suffix.
        subject: who moves; the folder where no manifest says so.
        metres_per_unit: of the file's lengths; None where nobody says (it is then told from the
            legs' length, which only matters for ``Motion.metres``).
        category: of the motion, "" where nobody says.
        seconds: of the clip, 0 where nobody says.
    """

    path: Path
    set_name: str
    clip: str
    subject: str
    metres_per_unit: float | None = None
    category: str = ""
    seconds: float = 0.0

    @property
    def name(self) -> str:
        """Set and clip: the name of the Motion."""
        return f"{self.set_name}/{self.clip}"


def find_clips(paths: Iterable[str | Path], metres_per_unit: float | None = None) -> list[ClipFile]:
    """The BVH files among files and folders (searched with all below), sorted.

    A ``manifest.csv`` beside the clips, or up to two folders above, adds subject, unit, category.

    Args:
        paths: files and folders.
        metres_per_unit: overrules the manifest.

    Raises:
        FileFormatError: a path does not exist, or there is no clip in any.
    """
    found: dict[Path, None] = {}
    for path in map(Path, paths):
        if path.is_dir():
            found.update(dict.fromkeys(sorted(p for p in path.rglob("*") if _is_bvh(p))))
        elif path.is_file():
            found[path] = None
        else:
            raise FileFormatError(f"{path}: no such file or folder. Check the path.")
    if not found:
        raise FileFormatError("no .bvh file in " + ", ".join(map(str, paths)) + ". Check the path.")
    manifests: dict[Path, dict[str, dict[str, str]]] = {}
    return [_clip(path, manifests, metres_per_unit) for path in found]


def _is_bvh(path: Path) -> bool:
    return path.suffix.lower() == ".bvh" and path.is_file()


def _clip(
    path: Path, manifests: dict[Path, dict[str, dict[str, str]]], metres_per_unit: float | None
) -> ClipFile:
    folder = path.resolve().parent
    set_name = folder.parent.name if folder.name == "clips" else folder.name
    row: dict[str, str] = {}
    for above in (folder, *list(folder.parents)[:2]):
        if above not in manifests:
            manifests[above] = _read_manifest(above / "manifest.csv")
        row = manifests[above].get(path.name, {})
        if row:
            break
    subject = row.get("subject", "") or set_name
    return ClipFile(
        path,
        set_name,
        path.stem,
        _with_player(subject, path.stem),
        metres_per_unit or float(row.get("metres_per_unit") or 0.0) or None,
        row.get("category", ""),
        float(row.get("seconds") or 0.0),
    )


def _with_player(subject: str, clip: str) -> str:
    """In a session of several the last number of ``s_SESSION_TAKE_PLAYER`` is the player."""
    player = re.fullmatch(r"s_\d+_\d+_(\d+)", clip)
    if player and "session" in subject and not re.search("player|performer", subject):
        return f"{subject} player {player[1]}"
    return subject


def _read_manifest(path: Path) -> dict[str, dict[str, str]]:
    """Rows by file name."""
    if not path.is_file():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {Path(row["file"]).name: row for row in rows if row.get("file")}


@dataclass(frozen=True, slots=True)
class Fault:
    """Something known to be wrong with a clip.

    Attributes:
        set_name: of the clip.
        clip: its name.
        action: ``leave_out``, ``cut`` or ``care``.
        frames: first and last of each bad stretch at the clip's own rate, last None to the end;
            empty: to be found.
        why: in words.
    """

    set_name: str
    clip: str
    action: str
    frames: tuple[tuple[int, int | None], ...]
    why: str


def read_faults(path: str | Path) -> list[Fault]:
    """Read a list of faults: ``set,clip,action,frames,why``."""
    with Path(path).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [
        Fault(r["set"], r["clip"], r["action"], _stretches(r["frames"] or ""), r["why"])
        for r in rows
    ]


def own_faults() -> list[Fault]:
    """The list that comes with this project."""
    return read_faults(Path(str(files("lobstr_hw.retargeting") / "faults.csv")))


def _stretches(text: str) -> tuple[tuple[int, int | None], ...]:
    """``"245, 349-354, 876-"`` -> ((245, 245), (349, 354), (876, None))."""
    out: list[tuple[int, int | None]] = []
    for part in filter(None, (p.strip() for p in text.split(","))):
        first, dash, last = part.partition("-")
        out.append((int(first), int(last) if last else (None if dash else int(first))))
    return tuple(out)
