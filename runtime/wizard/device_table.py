"""The devices in front of the wizard: numbered, in sight or not, and what each stands for."""

from collections.abc import Iterable, Sequence

from lobstr_hw.drivers.driver import BASE_STATION, DeviceInfo
from lobstr_hw.runtime.wizard.view import DeviceRow
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

__all__ = ["DeviceTable"]

SIGHT_S = 0.5
"""A device is in sight that was tracked this lately."""


_CYCLE: tuple[TrackerRole | None, ...] = (*FOUR_POINTS, None)


class DeviceTable:
    """Devices by number, in the order in which they appeared.

    Attributes:
        roles: serial -> role; each role once.
    """

    def __init__(self) -> None:
        """Nothing seen yet."""
        self.roles: dict[str, TrackerRole] = {}
        self._info: dict[str, DeviceInfo] = {}
        self._tracked_s: dict[str, float] = {}
        self._touched: set[str] = set()

    def update(self, devices: Iterable[DeviceInfo]) -> None:
        """Take in what devices say of themselves; the first that claims a role has it."""
        for device in devices:
            if device.kind == BASE_STATION:
                continue
            self._info[device.serial] = device
            role, serial = device.role_hint, device.serial
            if role is None or serial in self._touched or role in self.roles.values():
                continue
            self.roles.setdefault(serial, role)

    def see(self, samples: Iterable[TrackerSample]) -> None:
        """Note which devices are tracked."""
        for sample in samples:
            self._info.setdefault(sample.serial, DeviceInfo(sample.serial, "tracker"))
            if sample.tracked and sample.T_world_tracker.p is not None:
                self._tracked_s[sample.serial] = sample.time_s

    def in_sight(self, serial: str, now_s: float) -> bool:
        """Tracked within the last half second."""
        return now_s - self._tracked_s.get(serial, -float("inf")) <= SIGHT_S

    def missing(self, now_s: float) -> tuple[TrackerRole, ...]:
        """Roles of the four without a device in sight."""
        there = {role for serial, role in self.roles.items() if self.in_sight(serial, now_s)}
        return tuple(role for role in FOUR_POINTS if role not in there)

    def nameless(self, now_s: float) -> int:
        """How many devices in sight stand for nothing."""
        seen = (serial for serial in self._info if serial not in self.roles)
        return sum(self.in_sight(serial, now_s) for serial in seen)

    def guess(self, serials: Sequence[str]) -> None:
        """Take roles from a T-pose: ``serials`` in the order of FOUR_POINTS."""
        for serial, role in zip(serials, FOUR_POINTS, strict=True):
            self._give(serial, role)

    def change(self, number: int) -> str:
        """Give the device of this number the next role; who had it takes the old one.

        Returns:
            What it is now, in words; empty when there is no such number.
        """
        serials = list(self._info)
        if not 1 <= number <= len(serials):
            return ""
        serial = serials[number - 1]
        old = self.roles.get(serial)
        spare = next((s for s in serials if s not in self.roles and s != serial), None)
        at = _CYCLE.index(old) if old in _CYCLE else -1
        new = _CYCLE[(at + 1) % len(_CYCLE)]
        if new is None and spare is None:  # no other device could take over
            new = _CYCLE[0]
        self._touched.update(serials)
        self._give(serial, new)
        if new is None and spare is not None and old is not None:
            self.roles[spare] = old
        return f"number {number} is {'nothing' if new is None else new.replace('_', ' ')}"

    def _give(self, serial: str, role: TrackerRole | None) -> None:
        """A role for a device; who had it takes the old one."""
        old = self.roles.pop(serial, None)
        if role is None:
            return
        holder = next((s for s, r in self.roles.items() if r is role), None)
        if holder is not None:
            del self.roles[holder]
            if old is not None:
                self.roles[holder] = old
        self.roles[serial] = role

    def rows(self, now_s: float) -> tuple[DeviceRow, ...]:
        """All of them, to be shown."""
        return tuple(
            DeviceRow(
                i,
                serial,
                info.kind,
                self.roles.get(serial),
                self.in_sight(serial, now_s),
                info.battery,
            )
            for i, (serial, info) in enumerate(self._info.items(), start=1)
        )
