"""The stream of words in which a device tells syncs and sweeps of Gen2 stations (light mode 1).

    channel marker, 1 byte           sync, u32                     sweep, u32
    bit  0     1                     bit  0      0                 bit  0      0
    bit  1, 3  0                     bit  1      0                 bit  1      1
    bit  2     two stations here     bits 2-25   time              bit  2      half a tick later
    bits 4-7   channel               bit  26     OOTX data bit     bits 3-26   time
                                     bit  27     "g"               bits 27-31  port of the sensor
                                     bits 28-31  0

A marker holds for the words after it, within one packet. Words without one mean nothing.
"""

from typing import NamedTuple

__all__ = ["SweepWord", "SyncWord", "parse_words"]

MARKER, MARKER_ZEROS = 0b0001, 0b1010
SWEEP, HALF_TICK = 0b010, 0b100
TIME = (1 << 24) - 1
WORD_BYTES = 4


class SyncWord(NamedTuple):
    """A station's turn began; ``time`` has 24 bits."""

    channel: int
    time: int
    data_bit: int
    g_bit: int


class SweepWord(NamedTuple):
    """A sweep hit a sensor; ``time`` has 24 bits."""

    channel: int
    port: int
    time: int
    half_tick: int


def parse_words(data: bytes) -> list[SyncWord | SweepWord]:
    """The words of one packet, as far as it makes sense."""
    words: list[SyncWord | SweepWord] = []
    channel, at = -1, 0
    while at < len(data):
        if data[at] & MARKER:
            if data[at] & MARKER_ZEROS:
                break
            channel = data[at] >> 4
            at += 1
            continue
        word = int.from_bytes(data[at : at + WORD_BYTES], "little")
        if at + WORD_BYTES > len(data) or channel < 0:
            break
        at += WORD_BYTES
        if word & SWEEP:
            words.append(
                SweepWord(channel, word >> 27, word >> 3 & TIME, (word & HALF_TICK) // HALF_TICK)
            )
        elif word >> 28 == 0:
            words.append(SyncWord(channel, word >> 2 & TIME, word >> 26 & 1, word >> 27 & 1))
    return words
