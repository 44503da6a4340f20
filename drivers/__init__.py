"""Device drivers, one module or folder per family; ``replay`` is one like the others.

A driver is named ``NAME[:key=value,...]``, as in ``replay:file=take.mcap``. The table below knows
where it lives; its module, and with it any vendor library, is imported when it is asked for.
"""

import re
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from lobstr_hw.drivers.driver import TrackerDriver

__all__ = ["DRIVERS", "driver_class", "load_driver", "split_driver_spec", "with_option"]

DRIVERS: Mapping[str, tuple[str, str]] = {
    "fake": ("lobstr_hw.drivers.fake", "FakeDriver"),
    "flock": ("lobstr_hw.drivers.flock", "FlockDriver"),
    "lighthouse": ("lobstr_hw.drivers.lighthouse.driver", "LighthouseDriver"),
    "openvr": ("lobstr_hw.drivers.openvr", "OpenVRDriver"),
    "openxr": ("lobstr_hw.drivers.openxr", "OpenXRDriver"),
    "polhemus": ("lobstr_hw.drivers.polhemus", "PolhemusDriver"),
    "replay": ("lobstr_hw.drivers.replay", "ReplayDriver"),
    "sample": ("lobstr_hw.drivers.sample", "SampleDriver"),
    "ultimate": ("lobstr_hw.drivers.ultimate", "UltimateDriver"),
    "vmc": ("lobstr_hw.drivers.vmc", "VmcDriver"),
}
"""Name to module and class."""

RUNTIME_KEYS = frozenset({"role", "name"})
"""Keys of a driver's spec that mean something to the runtime, not to the driver."""


def driver_class(name: str) -> type[TrackerDriver]:
    """The class of a driver, without making one.

    Raises:
        ValueError: no driver has this name.
    """
    if name not in DRIVERS:
        raise ValueError(f"no driver is called {name!r}; known: {', '.join(sorted(DRIVERS))}")
    module, attribute = DRIVERS[name]
    found: type[TrackerDriver] = getattr(import_module(module), attribute)
    return found


def split_driver_spec(spec: str) -> tuple[str, dict[str, str]]:
    """``NAME[:key=value,...]`` -> name and options; a value may hold colons, equals and commas.

    Raises:
        ValueError: something that is no ``key=value``, or a key given twice.
    """
    name, _, rest = spec.partition(":")
    options: dict[str, str] = {}
    # a comma begins a new option only before "key=": file names may hold commas
    for part in re.split(r",(?=[a-z_]+=)", rest) if rest else []:
        key, equals, value = part.partition("=")
        if not equals or not key or key in options:
            raise ValueError(f"{part!r} in {spec!r} is not one key=value (NAME:key=value,...)")
        options[key] = value
    return name, options


def with_option(spec: str, key: str, value: object) -> str | None:
    """The spec with one more option; as it is where that is set, None where the driver lacks it.

    Raises:
        ValueError: there is no such driver, or the spec cannot be read.
    """
    name, options = split_driver_spec(spec)
    if key not in getattr(driver_class(name), "options", {}):
        return None
    return spec if key in options else f"{spec}{',' if options else ':'}{key}={value}"


def load_driver(spec: str) -> TrackerDriver:
    """Make a driver from ``NAME[:key=value,...]``; it still has to be opened.

    ``role=`` and ``name=`` are the runtime's own and are not handed to the driver.

    Raises:
        ValueError: no such driver or option, a value of the wrong kind, or one that is missing.
    """
    name, options = split_driver_spec(spec)
    found = driver_class(name)
    known: Mapping[str, Callable[[str], Any]] = getattr(found, "options", {})
    values = {
        key: _converted(name, key, value, known)
        for key, value in options.items()
        if key not in RUNTIME_KEYS
    }
    try:
        return found(**values)
    except TypeError as error:  # an option without a default was left out
        needed = ", ".join(f"{key}=" for key in known if key not in values)
        raise ValueError(f"driver {name!r} needs more options, of: {needed}") from error


def _converted(name: str, key: str, value: str, known: Mapping[str, Callable[[str], Any]]) -> Any:
    if key not in known:
        options = ", ".join(sorted(known)) or "none"
        raise ValueError(f"driver {name!r} has no option {key!r}; known: {options}")
    try:
        return known[key](value)
    except ValueError as error:
        raise ValueError(
            f"driver {name!r}: {key}={value!r} is not a {known[key].__name__}"
        ) from error
