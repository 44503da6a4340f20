"""A capture file as a stream of bytes: compressed or not, perhaps cut anywhere."""

import gzip
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, cast

from lobstr_hw.errors import FileFormatError

__all__ = ["LONGEST", "CutShort", "open_capture", "take"]

LONGEST = 1 << 20
"""Bytes of the longest record that is believed: USB packets here have 64, strings a few hundred."""
GZIP_MAGIC = b"\x1f\x8b"
MOST_LAYERS = 3
"""Some captures were compressed and put away compressed once more."""


class CutShort(Exception):
    """The file ends here, in the middle of something; never leaves this package's readers."""


@contextmanager
def open_capture(path: Path) -> Iterator[IO[bytes]]:
    """A capture's bytes, unpacked.

    Raises:
        FileFormatError: there is no such file or it cannot be opened.
    """
    try:
        with ExitStack() as opened:
            stream: IO[bytes] = opened.enter_context(path.open("rb"))
            for _ in range(MOST_LAYERS):
                is_gzip = _starts(stream) == GZIP_MAGIC
                stream.seek(0)
                if not is_gzip:
                    break
                stream = cast(IO[bytes], opened.enter_context(gzip.open(stream)))
            yield stream
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error}") from error


def _starts(stream: IO[bytes]) -> bytes:
    try:
        return take(stream, len(GZIP_MAGIC))
    except CutShort:
        return b""


def take(stream: IO[bytes], count: int) -> bytes:
    """Exactly so many bytes.

    Raises:
        CutShort: the file ends before them, or its compressed stream does or is broken there.
    """
    try:
        data = stream.read(count)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise CutShort from error
    if len(data) < count:
        raise CutShort
    return data
