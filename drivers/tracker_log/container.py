"""The MCAP container: records of a file as far as it goes, and rewriting it compressed."""

import os
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from zstandard import ZstdError

from lobstr_hw.errors import LogFileError

__all__ = ["LIBRARY", "PROFILE", "RecordFile", "copy_compressed", "replace_file"]

PROFILE = ""
"""MCAP's own word for the conventions of a file; ours are foxglove's schemas, which need none."""
LIBRARY = "lobstr-hw"
MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 1024 * 1024
"""Of JSON before compression: 12 s of four trackers. What damage takes away is whole chunks; four
times as large ones save 0.3 % of the file, a quarter as large ones cost 2 %."""

# what mcap, zstd, lz4 and struct raise on a file that was cut or damaged
_DAMAGE = (McapError, ValueError, struct.error, ZstdError, RuntimeError, MemoryError)


@dataclass(slots=True)
class RecordFile:
    """Iterates over a file's records in the order of writing; a cut file ends early.

    Attributes:
        path: of the file.
        damage: after iterating: why it ended early, or "" for a whole file.
    """

    path: Path
    damage: str = field(default="", init=False)

    def __post_init__(self) -> None:
        """Look at the first bytes.

        Raises:
            LogFileError: no such file, or not an MCAP file.
        """
        try:
            with self.path.open("rb") as stream:
                magic = stream.read(len(MAGIC))
        except OSError as error:
            raise LogFileError(
                f"{self.path}: {error.strerror or error}. Give the path of a tracker log (.mcap)."
            ) from error
        if magic != MAGIC:
            raise LogFileError(
                f"{self.path} is not a tracker log: it does not begin as an MCAP file does. "
                "Make one from a clip with: lobstr-log make CLIP.bvh OUT.mcap"
            )

    def __iter__(self) -> Iterator[McapRecord]:
        """Each record once; sets ``damage`` where the file ends early."""
        self.damage = ""
        # no record is longer than the file: a longer one is a damaged length
        limit = self.path.stat().st_size
        with self.path.open("rb") as stream:
            records = StreamReader(stream, validate_crcs=True, record_size_limit=limit).records
            while True:
                try:
                    record = next(records)
                except StopIteration:
                    return
                except _DAMAGE as error:
                    self.damage = _reason(error, stream.tell(), limit)
                    return
                yield record


def _reason(error: BaseException, at: int, size: int) -> str:
    if at >= size:
        return "the file ends in the middle"
    return f"damaged near byte {at} of {size} ({type(error).__name__})"


def copy_compressed(
    source: RecordFile, target: Path, progress: Callable[[int], None] | None = None
) -> int:
    """Write the records again in zstd chunks with an index; the target appears whole or not at all.

    Args:
        source: the file to read, as far as it goes.
        target: may be the source itself.
        progress: told the number of messages copied, every thousand.

    Returns:
        The number of messages copied.
    """
    part = target.with_name(target.name + ".part")
    try:
        with part.open("wb") as stream:
            copier = _Copier(Writer(stream, CHUNK_BYTES, CompressionType.ZSTD))
            for record in source:
                copier.add(record)
                if progress and copier.messages % 1000 == 0:
                    progress(copier.messages)
            copier.finish()
        replace_file(part, target)
    finally:
        part.unlink(missing_ok=True)
    return copier.messages


class _Copier:
    """Hands records on to a writer, which gives schemas and channels numbers of its own."""

    def __init__(self, writer: Writer) -> None:
        self.messages = 0
        self._writer = writer
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}
        writer.start(PROFILE, LIBRARY)

    def add(self, record: McapRecord) -> None:
        if isinstance(record, Message):
            self.messages += 1
            self._writer.add_message(
                self._channels[record.channel_id],
                record.log_time,
                record.data,
                record.publish_time,
                record.sequence,
            )
        elif isinstance(record, Schema):  # they stand twice in a file: at first use and at the end
            if record.id not in self._schemas:
                self._schemas[record.id] = self._writer.register_schema(
                    record.name, record.encoding, record.data
                )
        elif isinstance(record, Channel):
            if record.id not in self._channels:
                self._channels[record.id] = self._writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    self._schemas[record.schema_id],
                    record.metadata,
                )
        elif isinstance(record, Metadata):
            self._writer.add_metadata(record.name, record.metadata)
        elif isinstance(record, Attachment):
            self._writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )

    def finish(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]


def replace_file(source: Path, target: Path, tries: int = 20) -> None:
    """``os.replace``, again and again while Windows' virus scanner still holds the file."""
    for left in reversed(range(tries)):
        try:
            os.replace(source, target)
            return
        except PermissionError:
            if not left:
                raise
            time.sleep(0.05)
