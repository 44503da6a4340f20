"""A device that sends records over a line: bytes in, readings out."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Generic, Protocol, TypeVar

from lobstr_hw.drivers.reading_thread import LinkLost, Reading
from lobstr_hw.drivers.serial_stream import cut_records

__all__ = ["Link", "RecordSource"]

ANSWER_READS = 40
"""Two seconds of reading, in which a device that was set going must have sent a record."""

Record = TypeVar("Record")


class Link(Protocol):
    """A serial line, or USB."""

    def read(self) -> bytes:
        """What has come in; waits 0.05 s at most."""
        ...

    def write(self, data: bytes) -> None:
        """Send."""
        ...

    def quiet(self) -> None:
        """Throw away what comes in until nothing does."""
        ...

    def close(self) -> None:
        """Release the line."""
        ...


class RecordSource(Generic[Record]):
    """An open device whose records all have one length."""

    def __init__(
        self,
        link: Link,
        length: int,
        parse: Callable[[bytes], Record | None],
        reading: Callable[[Record], Reading],
    ) -> None:
        """Put a meaning to what comes from a link."""
        self._link, self._length, self._parse, self._reading = link, length, parse, reading
        self._buffer = b""
        self._first: list[Reading] = []
        self._stop: Sequence[bytes] = ()

    def start(self, stop: Sequence[bytes], go: Sequence[bytes]) -> bool:
        """Silence the device, set it up, and wait for its first record; False: none came.

        Raises:
            LinkLost: the line went meanwhile; it is closed.
        """
        self._stop = stop
        try:
            for command in stop:
                self._link.write(command)
            self._link.quiet()
            for command in go:
                self._link.write(command)
            return self._answers()
        except LinkLost:
            self.close()
            raise

    def _answers(self) -> bool:
        for _ in range(ANSWER_READS):
            self._first = self.read()
            if self._first:
                return True
        return False

    def read(self) -> list[Reading]:
        """What came in."""
        first, self._first = self._first, []
        if first:
            return first
        data = self._buffer + self._link.read()
        records, self._buffer = cut_records(data, self._length, self._parse)
        return [self._reading(record) for record in records]

    def close(self) -> None:
        """Silence the device, if it is still there, and let go of the line."""
        with suppress(LinkLost):
            for command in self._stop:
                self._link.write(command)
        self._link.close()
