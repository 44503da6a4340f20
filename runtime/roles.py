"""Which body part each device stands for: by the profile, or by what the devices say they are."""

from collections.abc import Callable, Collection, Mapping, Sequence

from lobstr_hw.drivers.driver import DeviceInfo
from lobstr_hw.errors import MissingRole
from lobstr_hw.trackers import TrackerRole

__all__ = ["RoleTable"]


class RoleTable:
    """Serial -> role. A profile is binding; without one, role hints count, first come first served."""

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

    def of(self, serial: str) -> TrackerRole | None:
        """The role of a serial, if it has one."""
        role = self._roles.get(serial)
        if role is None and not self._fixed:
            self._read_hints()
            role = self._roles.get(serial)
        return role

    def require(self, roles: Collection[TrackerRole]) -> None:
        """Check the devices that are there against the roles that are needed.

        Raises:
            MissingRole: names what is missing and what was seen.
        """
        devices = self._devices()
        bound = {device.serial: self.of(device.serial) for device in devices}
        missing = [role for role in roles if role not in bound.values()]
        if not missing:
            return
        seen = ", ".join(f"{serial} ({role or 'no role'})" for serial, role in bound.items())
        by = "the profile" if self._fixed else "its device"
        raise MissingRole(
            f"no tracker is bound to {' and '.join(missing)} by {by}; seen: {seen or 'none'}. "
            "Switch the missing tracker on, or bind it by a new profile: lobstr-calibrate."
        )

    def _read_hints(self) -> None:
        for device in self._devices():
            if device.role_hint is not None and device.role_hint not in self._roles.values():
                self._roles[device.serial] = device.role_hint
