r"""``--output SINK``: what the user writes, and the output that it means.

NAME:REST                       bvh:C:\takes\out.bvh, ndjson:-
NAME://host:port?key=value      for sinks on the network
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from lobstr_hw.drivers.driver import DeviceEvent
from lobstr_hw.runtime.outputs.output import Output
from lobstr_hw.runtime.outputs.queued import QueuedOutput
from lobstr_hw.trackers import TrackerRole

__all__ = ["SINKS", "SessionFacts", "SinkSpec", "make_output", "parse_sink"]


@dataclass(frozen=True, slots=True)
class SessionFacts:
    """What an output may ask about the session it belongs to.

    Attributes:
        role_of: the role of a serial at this moment, if it has one.
        unix_offset_s: given the session time of now, what to add to session times for UNIX time;
            None where nobody knows.
        tell: takes a message for the user.
        listen: takes what wants to be told of every event, in the thread of the loop.
    """

    role_of: Callable[[str], TrackerRole | None]
    unix_offset_s: Callable[[float], float | None]
    tell: Callable[[str], None]
    listen: Callable[[Callable[[DeviceEvent], None]], None]


@dataclass(frozen=True, slots=True)
class SinkSpec:
    """A sink as written: its name, what stands behind the first colon, and its options."""

    name: str
    rest: str
    options: dict[str, str] = field(default_factory=dict)

    def __str__(self) -> str:
        """As the user knows it."""
        return f"{self.name}:{self.rest}"


class _Maker(Protocol):
    def __call__(self, spec: SinkSpec, facts: SessionFacts) -> Output: ...


def _bvh(spec: SinkSpec, facts: SessionFacts) -> Output:
    from lobstr_hw.runtime.outputs.bvh import BvhOutput

    return BvhOutput(Path(spec.rest))


def _mcap(spec: SinkSpec, facts: SessionFacts) -> Output:
    from lobstr_hw.runtime.outputs.mcap import McapOutput

    output = McapOutput(Path(spec.rest), facts.role_of, facts.unix_offset_s)
    facts.listen(output.events.append)
    return output


def _ndjson(spec: SinkSpec, facts: SessionFacts) -> Output:
    from lobstr_hw.runtime.outputs.ndjson import NdjsonOutput

    return NdjsonOutput(spec.rest)


SINKS: dict[str, _Maker] = {"bvh": _bvh, "mcap": _mcap, "ndjson": _ndjson}
"""By name; each imports its module only when it is asked for."""


def parse_sink(text: str) -> SinkSpec:
    """Split a sink at its first colon.

    Raises:
        ValueError: it names no known sink, or nothing to write to, or an unknown option.
    """
    name, colon, rest = text.partition(":")
    known = ", ".join(SINKS)
    if not colon:
        raise ValueError(f"{text!r} is no sink: write NAME:FILE with one of {known}")
    if name not in SINKS:
        raise ValueError(f"unknown sink {name!r} in {text!r}; known are {known}")
    rest, options = _split_options(rest)
    if not rest:
        raise ValueError(f"{text!r} names no file: write {name}:FILE")
    if rest.startswith("//"):
        raise ValueError(f"{name} writes a file, not to {rest}: write {name}:FILE")
    if options:
        raise ValueError(f"{name} has no option {', '.join(options)}")
    return SinkSpec(name, rest, options)


def _split_options(rest: str) -> tuple[str, dict[str, str]]:
    """``rest?key=value&key=value``; a question mark without such pairs belongs to the name."""
    before, mark, query = rest.rpartition("?")
    pairs = [pair.partition("=") for pair in query.split("&")]
    if not mark or not all(key and equals for key, equals, _ in pairs):
        return rest, {}
    return before, {key: value for key, _, value in pairs}


def make_output(spec: SinkSpec, facts: SessionFacts) -> QueuedOutput:
    """The output of a sink, behind its queue; nothing is opened yet.

    Args:
        spec: from :func:`parse_sink`.
        facts: about the session; ``tell`` is told once when the output dies.
    """
    return QueuedOutput(str(spec), SINKS[spec.name](spec, facts), facts.tell)
