"""Roles that the user gave to serials, as in ``--driver openvr:pelvis=LHR-1A2B3C4D``."""

from collections.abc import Callable, Mapping

from lobstr_hw.trackers import TrackerRole

__all__ = ["ROLE_OPTIONS", "by_serial", "hint"]

ROLE_OPTIONS: Mapping[str, Callable[[str], str]] = {role.value: str for role in TrackerRole}
"""The driver options: a serial for each role."""


def by_serial(serials: Mapping[str, str]) -> dict[str, TrackerRole]:
    """Options, role to serial, the other way round."""
    return {serial: TrackerRole(role) for role, serial in serials.items()}


def hint(
    serial: str, said: TrackerRole | None, chosen: Mapping[str, TrackerRole]
) -> TrackerRole | None:
    """The role of a device: as chosen, else as it says itself.

    Args:
        serial: of the device.
        said: what it, or its runtime, says it stands for.
        chosen: serial -> role; a role chosen for one device is nobody else's.
    """
    if serial in chosen:
        return chosen[serial]
    return None if said in chosen.values() else said
