"""Bits of a base station's light -> frames of bytes (OOTX, "omnidirectional optical transmitter").

    17 zeros, 1                            where a frame begins; nowhere else in it
    16 data bits, 1, 16 data bits, 1 ...   most significant bit of a byte first

    0        u16 n, bytes of the payload
    2        payload, and a zero if n is odd
    2 + n'   u32 CRC-32 of the n bytes

A station repeats its frame without a pause, so a whole frame is known after as many bits as it has,
wherever the first of them stood; a bit that was missed comes again; and the last missing few follow
from the CRC, which is linear in them.
"""

import zlib
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["GEN1_PAYLOAD", "GEN2_PAYLOAD", "OotxReader", "StationBits"]

GEN1_PAYLOAD, GEN2_PAYLOAD = 33, 43
BEGIN = bytes(17) + b"\1"
WORD_BITS = 16
LENGTH_BYTES, CRC_BYTES = 2, 4
MISSING = 2
MOST_MISSING = 14
"""Bits that may follow from the CRC: the 18 others of its 32 still tell whether it is right."""


@dataclass(frozen=True, slots=True)
class StationBits:
    """Bits of a station, one a flash (Gen1) or turn (Gen2); None: it was missed.

    ``fresh``: nobody knows how many were missed before them, so a reader begins anew.
    """

    station: int
    bits: tuple[int | None, ...]
    fresh: bool


class OotxReader:
    """Reads the bits of one station as one device sees them."""

    def __init__(self, payload_bytes: int) -> None:
        """No bit was seen; stations of one generation send so many bytes."""
        self._padded = payload_bytes + payload_bytes % 2
        words = (LENGTH_BYTES + self._padded + CRC_BYTES) * 8 // WORD_BITS
        self._payload_bytes = payload_bytes
        self._ring = bytearray([MISSING]) * (len(BEGIN) + words * (WORD_BITS + 1))
        self._at = 0
        self._wait = 0

    def feed(self, bits: Iterable[int | None]) -> bytes | None:
        """The next bits, None for one that was missed.

        Returns:
            The newest payload that became known with them, its CRC being right; of each pass of a
            frame once.
        """
        newest = None
        for bit in bits:
            if bit is not None:
                self._ring[self._at] = bit
            self._at = (self._at + 1) % len(self._ring)
            self._wait -= 1
            if self._wait <= 0:
                payload = self._payload()
                self._wait = WORD_BITS if payload is None else len(self._ring)
                newest = payload or newest
        return newest

    def _payload(self) -> bytes | None:
        """The frame in the ring, wherever it begins."""
        if self._ring.count(MISSING) > MOST_MISSING:
            return None
        twice = bytes(self._ring + self._ring)
        for begin in range(len(self._ring)):
            if _fits(twice[begin : begin + len(BEGIN)], BEGIN):
                payload = self._read(twice[begin + len(BEGIN) : begin + len(self._ring)])
                if payload is not None:
                    return payload
        return None

    def _read(self, frame: bytes) -> bytes | None:
        if 0 in frame[WORD_BITS :: WORD_BITS + 1]:
            return None
        bits = bytearray(b for place, b in enumerate(frame) if (place + 1) % (WORD_BITS + 1))
        missing = [place for place, bit in enumerate(bits) if bit == MISSING]
        for place in missing:
            bits[place] = 0
        for place in _solve([self._syndrome(bits, p) for p in missing], self._syndrome(bits)):
            bits[missing[place]] = 1
        data = _bytes(bits)
        length = int.from_bytes(data[:LENGTH_BYTES], "little")
        if length != self._payload_bytes or self._syndrome(bits):
            return None
        return data[LENGTH_BYTES : LENGTH_BYTES + self._payload_bytes]

    def _syndrome(self, bits: bytearray, flipped: int | None = None) -> int:
        """CRC against CRC: 0 in a good frame; or what one flipped bit changes about it."""
        if flipped is not None:
            other = bits.copy()
            other[flipped] ^= 1
            return self._syndrome(bits) ^ self._syndrome(other)
        body = _bytes(bits)[LENGTH_BYTES:]
        return zlib.crc32(body[: self._payload_bytes]) ^ int.from_bytes(
            body[self._padded :], "little"
        )


def _fits(seen: bytes, pattern: bytes) -> bool:
    return all(bit in (MISSING, want) for bit, want in zip(seen, pattern, strict=True))


def _solve(effects: list[int], target: int) -> list[int]:
    """Which effects make the target, each bit of them being one equation modulo 2.

    Returns:
        Their places; none where several choices would do, or none does.
    """
    rows: list[tuple[int, int]] = []  # an effect made of others, and of which (as bits)
    for place, effect in enumerate(effects):
        effect, which = _reduce(effect, 1 << place, rows)
        if effect == 0:
            return []
        rows.append((effect, which))
    left, which = _reduce(target, 0, rows)
    return [] if left else [place for place in range(len(effects)) if which >> place & 1]


def _reduce(value: int, which: int, rows: list[tuple[int, int]]) -> tuple[int, int]:
    """Take out the highest bit of every row; rows stand in the order they were reduced in."""
    for effect, made_of in rows:
        if value >> (effect.bit_length() - 1) & 1:
            value, which = value ^ effect, which ^ made_of
    return value, which


def _bytes(bits: bytearray) -> bytes:
    return int("1" + "".join(map(str, bits)), 2).to_bytes(len(bits) // 8 + 1, "big")[1:]
