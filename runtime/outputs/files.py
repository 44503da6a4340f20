"""Opening a file for writing, with errors that say what to do."""

from pathlib import Path
from typing import BinaryIO

from lobstr_hw.errors import OutputError

__all__ = ["create"]


def create(path: Path) -> BinaryIO:
    """A new, unbuffered file; one that was there is replaced.

    Unbuffered, so that what was written is on its way to the disk when the process is killed.

    Raises:
        OutputError: when that is impossible here.
    """
    try:
        return open(path, "wb", buffering=0)
    except FileNotFoundError as error:
        raise OutputError(
            f"cannot write {path}: the folder {path.parent} does not exist; make it first."
        ) from error
    except OSError as error:
        raise OutputError(
            f"cannot write {path}: {error.strerror or error}; choose another file."
        ) from error
