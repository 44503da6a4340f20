"""Where samples come from: a log (``--sim``), drivers (``--driver``), or whatever is there."""

from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path

from lobstr_hw.drivers import DRIVERS, driver_class, load_driver, split_driver_spec
from lobstr_hw.drivers.driver import Probe, TrackerDriver
from lobstr_hw.errors import DriverError, TrackerNotFound
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.runtime.station_place import with_station_file
from lobstr_hw.trackers import TrackerRole

__all__ = [
    "TAKEN_UNASKED",
    "bundled_log",
    "driver_from_spec",
    "drivers_from_specs",
    "joined",
    "nothing_to_run",
    "space_name",
    "what_is_there",
]

TAKEN_UNASKED = ("openvr", "lighthouse")
"""In this order: where SteamVR runs it holds the hardware. All others have to be named, for they
are open to anybody (vmc), or hold on to what may not be a tracker (serial ports)."""


def bundled_log() -> Path:
    """The demo log of the package."""
    return Path(str(resources.files("lobstr_hw.runtime") / "demo" / "demo.mcap"))


def driver_from_spec(spec: str) -> TrackerDriver:
    """A driver from what the user wrote; not open yet.

    Raises:
        ValueError: no such driver or role, or an option it does not know.
    """
    _, options = split_driver_spec(spec)
    driver = load_driver(with_station_file(spec))
    if not {"role", "name"} & options.keys():
        return driver
    return PartDriver(driver, space_name(spec), _role(options.get("role"), spec))


def _role(text: str | None, spec: str) -> TrackerRole | None:
    if text is None:
        return None
    try:
        return TrackerRole(text)
    except ValueError as error:
        roles = ", ".join(TrackerRole)
        raise ValueError(f"role={text} in {spec!r} is not one of {roles}") from error


def space_name(spec: str) -> str:
    """What a profile calls the tracking space of a driver: its name, or the one it was given."""
    name, options = split_driver_spec(spec)
    return options.get("name", name)


def joined(specs: Sequence[str]) -> TrackerDriver:
    """One driver for all that the user named.

    Raises:
        ValueError: as in :func:`driver_from_spec`; or two have one name, or one role.
    """
    drivers = [driver_from_spec(spec) for spec in specs]
    if len(drivers) == 1 and not isinstance(drivers[0], PartDriver):
        return drivers[0]
    parts = [
        driver if isinstance(driver, PartDriver) else PartDriver(driver, space_name(spec))
        for driver, spec in zip(drivers, specs, strict=True)
    ]
    names = [part.name for part in parts]
    roles = [part.role for part in parts if part.role is not None]
    for twice in {x for x in names if names.count(x) > 1}:
        raise ValueError(f"two drivers are called {twice}; tell them apart: {twice}:name=...")
    for twice in {x for x in roles if roles.count(x) > 1}:
        raise ValueError(f"two drivers have role={twice}")
    return ManyDrivers(parts)


def drivers_from_specs(specs: Sequence[str], tell: Callable[[str], None]) -> TrackerDriver:
    """The drivers that the user named, as one; without any: what is there.

    Args:
        specs: as written, NAME[:key=value,...].
        tell: is told what was taken unasked.

    Raises:
        ValueError: no such driver, or an option it does not know.
        TrackerNotFound: none was named, and nothing is there.
    """
    return joined(specs) if specs else what_is_there(tell)


def what_is_there(tell: Callable[[str], None]) -> TrackerDriver:
    """SteamVR when it runs, else Lighthouse hardware on USB; not open.

    Raises:
        TrackerNotFound: nothing; the message says what was looked for, and how to get each.
    """
    looked = {}
    for name in TAKEN_UNASKED:
        if name not in DRIVERS:
            continue
        looked[name] = _probe(name)
        if looked[name].available:
            driver = load_driver(with_station_file(name))
            try:
                with driver:  # whether SteamVR runs, only a session with it can tell
                    pass
            except DriverError as error:
                looked[name] = Probe(False, str(error))
                continue
            tell(f"taking what is there: --driver {name}")
            return driver
    raise nothing_to_run(looked)


def _probe(name: str) -> Probe:
    try:
        return driver_class(name).probe()
    except Exception as error:  # a fault of one driver must not hide the others
        return Probe(False, f"its driver failed ({type(error).__name__}: {error})")


def nothing_to_run(looked: dict[str, Probe] | None = None) -> TrackerNotFound:
    """Neither a log nor a driver was named: say what there is, and how to get the rest.

    Args:
        looked: the probes of drivers that were tried already.
    """
    probes = {name: (looked or {}).get(name) or _probe(name) for name in sorted(DRIVERS)}
    found = [_row(name, probes[name]) for name in TAKEN_UNASKED if name in probes]
    named = [_row(name, probe) for name, probe in probes.items() if name not in TAKEN_UNASKED]
    return TrackerNotFound(
        "no trackers found.\n"
        + "\n".join([*found, "Listened to only when named, as in --driver vmc:", *named])
        + "\nWhat is plugged in: lobstr-devices\nTry it without any device: lobstr-live --sim"
    )


def _row(name: str, probe: Probe) -> str:
    if probe.available:
        return f"  {name}: ready"
    missing = f"missing: {probe.missing}; {probe.fix}" if probe.fix else probe.missing
    return f"  {name}: {missing}"
