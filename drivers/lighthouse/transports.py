"""The ways to reach devices on USB, by name; each library is imported only when used."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from lobstr_hw.drivers.driver import Probe
from lobstr_hw.drivers.lighthouse.hidapi_transport import HidapiTransport
from lobstr_hw.drivers.lighthouse.pyusb_transport import PyusbTransport
from lobstr_hw.drivers.lighthouse.transport import Transport
from lobstr_hw.errors import DriverUnavailable

__all__ = [
    "TRANSPORTS",
    "MissingTransport",
    "available_transports",
    "check_name",
    "choose_transport",
]

TRANSPORTS: tuple[Transport, ...] = (
    # leaves the kernel's driver in place; Linux only
    *([HidapiTransport("hidraw", module="hidraw")] if sys.platform == "linux" else []),
    HidapiTransport("hidapi", module="hid"),
    PyusbTransport(),
)
"""Best first."""


@dataclass(frozen=True, slots=True)
class MissingTransport:
    """A transport that cannot be used here, and why."""

    name: str
    why: Probe


def available_transports() -> tuple[Sequence[Transport], Sequence[MissingTransport]]:
    """What can be used here, best first, and what cannot; imports and opens nothing."""
    probes = [(transport, transport.probe()) for transport in TRANSPORTS]
    usable = [transport for transport, probe in probes if probe.available]
    return usable, [MissingTransport(t.name, p) for t, p in probes if not p.available]


def check_name(name: str) -> None:
    """Whether there is such a transport; whether it can be used is another question.

    Raises:
        ValueError: there is none of that name.
    """
    if name not in (known := [t.name for t in TRANSPORTS]):
        raise ValueError(f"transport={name}: here there are {', '.join(known)}")


def choose_transport(name: str | None = None) -> Transport:
    """The named transport, or the best one that there is.

    Raises:
        ValueError: there is none of that name.
        DriverUnavailable: it, or every one, misses something; the message says the cure.
    """
    usable, missing = available_transports()
    if name is not None:
        check_name(name)
    for transport in usable:
        if name in (None, transport.name):
            return transport
    lacking = [m for m in missing if name in (None, m.name)]
    why = "; ".join(f"{m.name} needs {m.why.missing}: {m.why.fix}" for m in lacking)
    raise DriverUnavailable(f"no way to reach Lighthouse devices on USB: {why}")
