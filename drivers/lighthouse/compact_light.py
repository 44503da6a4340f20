"""Gen1 pulses as a tracker packs them into radio messages.

    one byte a pulse             times between edges, backwards       last edge
    bits 3-7  port of sensor     7 bits a byte; bit 7: the last       u24 ticks
    bits 0-2  edges skipped      byte, reading backwards, of one

Both edges of every pulse stand in one list, e[0] the latest. A pulse ends at the first edge of the
list that no pulse before it took, and began ``skipped`` + 1 edges further down it.
"""

from lobstr_hw.drivers.lighthouse.reports import Pulse

__all__ = ["parse_compact_light"]

TIME_BYTES = 3
LONGEST = 0xFFFF
LONGEST_DARK = 1 << 24
"""Ticks (0.35 s) between edges of one message; the times of messages have no more bits."""


def parse_compact_light(data: bytes, last_edge: int) -> list[Pulse]:
    """The pulses of one message, by their start; none where the data contradict themselves.

    Args:
        data: of the message, with the time of the last edge at its end.
        last_edge: the same time with all its bits.
    """
    front = len(data) - TIME_BYTES
    edges = [last_edge]  # latest first
    while front > 0 and 2 * front > len(edges):
        interval, front = _number_before(data, front)
        if interval > LONGEST_DARK:
            return []
        edges.append(edges[-1] - interval)
    if front <= 0 or len(edges) != 2 * front:
        return []
    return sorted(_pair(data[:front], edges), key=lambda pulse: pulse[1])


def _number_before(data: bytes, end: int) -> tuple[int, int]:
    """A number whose last byte stands before ``end``, and where it begins; 0: it does not end."""
    value = 0
    while end > 0:
        end -= 1
        value = value << 7 | data[end] & 0x7F
        if data[end] & 0x80:
            return value, end
    return value, 0


def _pair(pulses: bytes, edges: list[int]) -> list[Pulse]:
    """Give every pulse its two edges; nothing if that cannot be done."""
    used = [False] * len(edges)
    found: list[Pulse] = []
    for pulse in pulses:
        end = used.index(False)
        start = end + (pulse & 7) + 1
        if start >= len(edges) or used[start] or edges[end] - edges[start] > LONGEST:
            return []
        used[end] = used[start] = True
        found.append((pulse >> 3, edges[start], edges[end] - edges[start]))
    return found
