"""The HIERARCHY section of a BVH file: joints, offsets, and which number is which channel."""

from dataclasses import dataclass, field
from pathlib import Path

from lobstr_hw.errors import MotionFileError

__all__ = ["Layout", "parse_hierarchy"]

_END_SITE = -2


@dataclass(slots=True)
class Layout:
    """What the hierarchy says.

    Attributes:
        names: of the joints, parents before children.
        parents: index of each joint's parent, -1 at the root.
        offsets: three numbers for each joint.
        channels: (joint, word) in the order of a motion line's numbers.
    """

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[list[float]] = field(default_factory=list)
    channels: list[tuple[int, str]] = field(default_factory=list)


def parse_hierarchy(head: str, path: Path) -> Layout:
    """Read all that stands before MOTION.

    Raises:
        MotionFileError: with the line that cannot be understood.
    """
    parser = _Parser()
    for number, line in enumerate(head.splitlines(), start=1):
        words = line.replace("{", " { ").replace("}", " } ").split()
        try:
            while words:
                words = parser.take(words[0], words[1:])
        except (ValueError, IndexError) as error:
            raise MotionFileError(
                f"{path}: line {number}: cannot be understood: {line.strip()!r} ({error}). "
                "Export the clip again as BVH."
            ) from error
    if not parser.layout.names:
        raise MotionFileError(f"{path}: no ROOT before MOTION. Is this a BVH file?")
    if parser.open:
        raise MotionFileError(
            f"{path}: line {head.count(chr(10)) + 1}: {len(parser.open)} brace(s) still open at "
            "MOTION. The file is damaged; export the clip again."
        )
    return parser.layout


class _Parser:
    """Joints whose brace is open, the innermost last, and the one whose brace comes next."""

    def __init__(self) -> None:
        self.layout = Layout()
        self.open: list[int] = []
        self.next: int | None = None

    def take(self, word: str, rest: list[str]) -> list[str]:
        """Understand one word with what belongs to it; returns the words after it."""
        match word:
            case "HIERARCHY":
                return rest
            case "ROOT" | "JOINT":
                return self._joint(rest)
            case "End":
                self.next = _END_SITE
                return [w for w in rest if w in "{}"]
            case "{":
                if self.next is None:
                    raise ValueError("a brace without a joint")
                self.open.append(self.next)
                self.next = None
                return rest
            case "}":
                self.open.pop()
                return rest
            case "OFFSET":
                return self._offset(rest)
            case "CHANNELS":
                return self._channels(rest)
        raise ValueError(f"unknown word {word!r}")

    def _joint(self, rest: list[str]) -> list[str]:
        end = rest.index("{") if "{" in rest else len(rest)
        self.layout.names.append(" ".join(rest[:end]))  # names with blanks exist
        self.layout.parents.append(self.open[-1] if self.open else -1)
        self.layout.offsets.append([0.0, 0.0, 0.0])
        self.next = len(self.layout.names) - 1
        return rest[end:]

    def _offset(self, rest: list[str]) -> list[str]:
        offset = [float(w) for w in rest[:3]]
        if len(offset) != 3:
            raise ValueError("OFFSET needs three numbers")
        if self.open[-1] != _END_SITE:
            self.layout.offsets[self.open[-1]] = offset
        return rest[3:]

    def _channels(self, rest: list[str]) -> list[str]:
        count = int(rest[0])
        words = rest[1 : 1 + count]
        if len(words) != count or not all(map(_is_channel, words)):
            raise ValueError(f"CHANNELS {count} with {words}")
        self.layout.channels.extend((self.open[-1], w) for w in words)
        return rest[1 + count :]


def _is_channel(word: str) -> bool:
    return word[:1] in set("XYZ") and word[1:] in ("position", "rotation")
