"""Which clip is used for what: a file of names, ``set/clip``."""

import json
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from lobstr_hw.errors import FileFormatError

__all__ = ["PARTS", "Split", "clip_name", "default_split", "read_split"]

PARTS = ("train", "validation", "test", "test_same_actor")


@dataclass(frozen=True, slots=True)
class Split:
    """Names of clips by part.

    Attributes:
        name: of the file.
        parts: part -> names.
        why: what each part is for, for people.
    """

    name: str
    parts: dict[str, frozenset[str]]
    why: dict[str, object]

    def part_of(self, name: str) -> str | None:
        """The part that a clip, or a piece of it (``...#1``), belongs to."""
        clip = clip_name(name)
        return next((part for part, names in self.parts.items() if clip in names), None)


def clip_name(name: str) -> str:
    """A motion's name without the number of the piece and the mark of a mirror image."""
    return name.partition("#")[0].partition("~")[0]


def read_split(path: Path) -> Split:
    """Read a split file.

    Raises:
        FileFormatError: it is missing, damaged, or names a clip in two parts.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        parts = {part: frozenset(document[part]) for part in PARTS}
        why = dict(document.get("why", {}))
    except OSError as error:
        raise FileFormatError(f"{path}: the split cannot be read ({error.strerror}).") from error
    except (ValueError, KeyError, TypeError) as error:
        raise FileFormatError(
            f"{path}: no split ({error!r}). It is JSON with the lists {', '.join(PARTS)}."
        ) from error
    names = [name for part in parts.values() for name in part]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise FileFormatError(f"{path}: in more than one part: {', '.join(twice)}.")
    return Split(path.stem, parts, why)


def default_split() -> Split:
    """The split that comes with this project."""
    return read_split(Path(str(files("lobstr_hw.training") / "splits" / "default.json")))
