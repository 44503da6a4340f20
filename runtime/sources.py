"""Where samples come from: a log (``--sim``) or drivers (``--driver``)."""

from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from lobstr_hw.drivers import DRIVERS, driver_class, load_driver, split_driver_spec
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.runtime.many_drivers import ManyDrivers

__all__ = ["bundled_log", "driver_from_spec", "drivers_from_specs", "joined", "nothing_to_run"]

RUNTIME_KEYS = ("role", "name")


def bundled_log() -> Path:
    """The demo log of the package."""
    return Path(str(resources.files("lobstr_hw.runtime") / "demo" / "demo.mcap"))


def driver_from_spec(spec: str) -> TrackerDriver:
    """A driver from what the user wrote; not open yet.

    Raises:
        ValueError: no such driver, or an option it does not know.
    """
    _, options = split_driver_spec(spec)
    for key in RUNTIME_KEYS:
        if key in options:
            raise ValueError(f"{key}= in {spec!r} is not supported yet; bind roles by a profile")
    return load_driver(spec)


def joined(drivers: Sequence[TrackerDriver]) -> TrackerDriver:
    """One driver for all of them."""
    return drivers[0] if len(drivers) == 1 else ManyDrivers(drivers)


def drivers_from_specs(specs: Sequence[str]) -> TrackerDriver:
    """The drivers that the user named, as one; without any: what is there.

    Raises:
        ValueError: no such driver, or an option it does not know.
        TrackerNotFound: none was named, and nothing is there.
    """
    if not specs:
        raise nothing_to_run()
    return joined([driver_from_spec(spec) for spec in specs])


def nothing_to_run() -> TrackerNotFound:
    """Neither a log nor a driver was named: say what there is."""
    rows = []
    for name in sorted(DRIVERS):
        probe = driver_class(name).probe()
        rows.append(f"  {name}: " + ("ready" if probe.available else f"{probe.missing}"))
        if probe.fix:
            rows[-1] += f" ({probe.fix})"
    return TrackerNotFound(
        "no trackers to listen to: neither --sim nor --driver was given. Drivers here:\n"
        + "\n".join(rows)
        + "\nTry it without any device: lobstr-live --sim"
    )
