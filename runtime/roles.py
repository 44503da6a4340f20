"""Which body part each device stands for: by the profile, or by what the devices say they are."""

from collections.abc import Callable, Collection, Mapping, Sequence

from lobstr_hw.drivers.driver import BASE_STATION, DeviceInfo
from lobstr_hw.errors import MissingRole
from lobstr_hw.trackers import TrackerRole

__all__ = ["RoleTable"]


class RoleTable:
    """Serial -> role: a calibration is binding; before it, what devices say, first come first."""

    def __init__(
        self,
        profile: Mapping[str, TrackerRole] | None,
        devices: Callable[[], Sequence[DeviceInfo]],
    ) -> None:
        """Start from a profile's table, or from none.

        Args:
            profile: the serials of a calibration profile; None when there is no profile.
            devices: lists the devices seen so far; asked again while a serial is unknown.
        """
        self._roles = dict(profile or {})
        self._devices = devices
        self._fixed = profile is not None

    def bind(self, roles: Mapping[str, TrackerRole]) -> None:
        """From now on only these trackers count."""
        self._roles = dict(roles)
        self._fixed = True

    def of(self, serial: str) -> TrackerRole | None:
        """The role of a serial, if it has one."""
        role = self._roles.get(serial)
        if role is None and not self._fixed:
            self._read_hints()
            role = self._roles.get(serial)
        return role

    def require(self, roles: Collection[TrackerRole]) -> None:
        """Check the devices that are there against the roles that are needed.

        Before a calibration a device that does not say what it is may be any of them.

        Raises:
            MissingRole: names what is missing and what was seen.
        """
        devices = [d for d in self._devices() if d.kind != BASE_STATION]
        bound = {device.serial: self.of(device.serial) for device in devices}
        missing = [role for role in roles if role not in bound.values()]
        open_to_any = 0 if self._fixed else list(bound.values()).count(None)
        if len(missing) <= open_to_any:
            return
        seen = ", ".join(f"{role or 'no role'} ({serial})" for serial, role in bound.items())
        raise MissingRole(
            f"no tracker stands for {' and '.join(missing)}; seen: {seen or 'none'}. Record again "
            "with all four switched on, or bind them by a new profile: lobstr-calibrate."
        )

    def _read_hints(self) -> None:
        for device in self._devices():
            if device.role_hint is not None and device.role_hint not in self._roles.values():
                self._roles[device.serial] = device.role_hint
