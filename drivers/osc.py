"""Open Sound Control 1.0, reading only, and of anybody's bytes: what is malformed is left out."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["Arg", "OscMessage", "read_packet"]

BUNDLE = b"#bundle\0"
BUNDLE_HEAD = 16
"""The word and a time tag, which VMC leaves at "now"."""
DEEPEST = 4
"""Bundles in bundles; nobody sends even two."""

Arg = int | float | str | bytes | bool | None


@dataclass(frozen=True, slots=True)
class OscMessage:
    """An address and what was sent to it."""

    address: str
    args: tuple[Arg, ...]


# A packet is a message or a bundle; all in multiples of four bytes, big-endian:
#
#   message  address string | ',' and type letters, as a string | arguments one after another
#   bundle   "#bundle" NUL | 8 bytes of time | any number of (i32 length | packet)
#   string   bytes, one to four NULs
NUMBERS = {tag: struct.Struct(">" + tag) for tag in "ifdq"}
NUMBERS["h"] = NUMBERS.pop("q")
CONSTANTS: dict[str, Arg] = {"T": True, "F": False, "N": None}


def read_packet(data: bytes) -> list[OscMessage]:
    """The messages of one datagram, in order.

    A message that is malformed, or has arguments of a kind that VMC does not use, is left out; the
    rest of a bundle whose lengths are wrong, too. Nothing that can be sent raises.
    """
    return list(_packet(data, 0))


def _packet(data: bytes, depth: int) -> Iterator[OscMessage]:
    if data.startswith(BUNDLE):
        if depth < DEEPEST:
            yield from _bundle(data, depth)
        return
    try:
        yield _message(data)
    except (ValueError, struct.error):
        return


def _bundle(data: bytes, depth: int) -> Iterator[OscMessage]:
    at = BUNDLE_HEAD
    while at + 4 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        at += 4
        if length == 0 or at + length > len(data):
            return
        yield from _packet(data[at : at + length], depth + 1)
        at += length


def _message(data: bytes) -> OscMessage:
    address, at = _string(data, 0)
    tags, at = _string(data, at)
    if not address.startswith("/") or not tags.startswith(","):
        raise ValueError("not a message")
    args: list[Arg] = []
    for tag in tags[1:]:
        value, at = _argument(data, at, tag)
        args.append(value)
    return OscMessage(address, tuple(args))


def _argument(data: bytes, at: int, tag: str) -> tuple[Arg, int]:
    if tag in NUMBERS:
        number = NUMBERS[tag]
        return number.unpack_from(data, at)[0], at + number.size
    if tag in "sS":
        return _string(data, at)
    if tag in CONSTANTS:
        return CONSTANTS[tag], at
    if tag == "b":
        (length,) = NUMBERS["i"].unpack_from(data, at)
        if not 0 <= length <= len(data) - at - 4:
            raise ValueError("a blob that is longer than its packet")
        return data[at + 4 : at + 4 + length], at + 4 + (length + 3) // 4 * 4
    raise ValueError(f"unknown type {tag!r}")


def _string(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(0, at)
    return data[at:end].decode("utf-8"), at + (end - at) // 4 * 4 + 4
