"""What somebody in a headset should be warned of: once when it begins, once when it ends."""

from collections.abc import Mapping, Sequence

from lobstr_hw.drivers.driver import DeviceInfo
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.skeleton_pose import RoleReport
from lobstr_hw.trackers import TrackerRole

__all__ = ["BATTERY_LOW", "LOST_S", "Alarms"]

LOST_S = 1.0
"""Shorter losses happen all the time, and nobody could do anything about them."""
BACK_S = 0.5
BATTERY_LOW = (0.15, 0.05)
"""A warning at each."""
BATTERY_FINE = 0.20
"""A battery that was charged up to here may be warned of again."""


class Alarms:
    """Told how everything fares, says what is worth a word."""

    def __init__(self) -> None:
        """All is well."""
        self._ok_since_s: dict[TrackerRole, float] = {}
        self._ok_s: dict[TrackerRole, float] = {}
        self._lost: set[TrackerRole] = set()
        self._warned: dict[str, float] = {}
        self._claimed: dict[str, TrackerRole] = {}

    def trackers(self, now_s: float, reports: Mapping[TrackerRole, RoleReport]) -> list[Spoken]:
        """Trackers lost and found again; one that was never there is not lost."""
        said = []
        for role, report in reports.items():
            name = role.replace("_", " ").capitalize()
            if report.state == "ok":
                self._ok_s[role] = now_s
                since_s = self._ok_since_s.setdefault(role, now_s)
                if role in self._lost and now_s - since_s >= BACK_S:
                    self._lost.remove(role)
                    said.append(Spoken(f"{name} tracker is back.", Sound.DONE))
                continue
            self._ok_since_s.pop(role, None)
            lost = now_s - self._ok_s.get(role, float("inf")) >= LOST_S
            if lost and role not in self._lost:
                self._lost.add(role)
                said.append(Spoken(f"{name} tracker lost.", Sound.TROUBLE))
        return said

    def roles(
        self, devices: Sequence[DeviceInfo], roles: Mapping[str, TrackerRole]
    ) -> list[Spoken]:
        """Devices that say now that they are something else than the calibration has it."""
        said = []
        for device in devices:
            role, claimed = roles.get(device.serial), device.role_hint
            if role is None or claimed is None or self._claimed.get(device.serial, role) == claimed:
                continue
            self._claimed[device.serial] = claimed
            if claimed is not role:
                names = (claimed.replace("_", " "), role.replace("_", " "))
                words = (
                    "A tracker says that it is the {}; it still counts as the {}. Calibrate again."
                )
                said.append(Spoken(words.format(*names), Sound.TROUBLE))
        return said

    def batteries(
        self, devices: Sequence[DeviceInfo], roles: Mapping[str, TrackerRole]
    ) -> list[Spoken]:
        """Batteries that run low."""
        said = []
        for device in devices:
            charge = device.battery
            if charge is None:
                continue
            if charge >= BATTERY_FINE:
                self._warned.pop(device.serial, None)
            step = min((low for low in BATTERY_LOW if charge <= low), default=None)
            if step is None or self._warned.get(device.serial, 1.0) <= step:
                continue
            self._warned[device.serial] = step
            role = roles.get(device.serial)
            name = device.serial if role is None else role.replace("_", " ")
            words = f"Battery of {name} is low, {100.0 * charge:.0f} percent."
            said.append(Spoken(words, Sound.TROUBLE))
        return said
