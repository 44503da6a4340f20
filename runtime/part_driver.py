"""One driver of several: what ``role=`` and ``name=`` of its spec say goes before what it says."""

from collections.abc import Collection, Sequence
from dataclasses import replace

from lobstr_hw.drivers.driver import BASE_STATION, DeviceEvent, DeviceInfo, TrackerDriver
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["PartDriver"]


class PartDriver(TrackerDriver):
    """A driver, known by a name, whose trackers all lie in one tracking space.

    Attributes:
        name: of that space, as in the profile; that of the driver unless the user gave another.
        role: what its (first) tracker stands for; None: what the driver says.
        taken: roles that the user gave to other drivers: no tracker of this one has them.
    """

    def __init__(self, driver: TrackerDriver, name: str, role: TrackerRole | None = None) -> None:
        """Wrap a driver that is not open yet."""
        self.name, self.role = name, role
        self.taken: Collection[TrackerRole] = ()
        self._driver = driver
        self._serials: set[str] = set()

    def has(self, serial: str) -> bool:
        """Whether a sample or device with this serial came from here."""
        return serial in self._serials

    def open(self) -> None:
        """Open the driver."""
        self._serials.clear()
        self._driver.open()

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """The driver's samples as they are."""
        samples = self._driver.poll(now_s)
        self._serials.update(sample.serial for sample in samples)
        return samples

    def devices(self) -> Sequence[DeviceInfo]:
        """The driver's devices, with the role that the user gave."""
        devices = self._driver.devices()
        self._serials.update(device.serial for device in devices)
        if self.role is None:
            return [self._without_taken(device) for device in devices]
        first = next((d.serial for d in devices if d.kind != BASE_STATION), None)
        return [replace(d, role_hint=self.role if d.serial == first else None) for d in devices]

    def _without_taken(self, device: DeviceInfo) -> DeviceInfo:
        return replace(device, role_hint=None) if device.role_hint in self.taken else device

    def events(self) -> Sequence[DeviceEvent]:
        """The driver's events."""
        return self._driver.events()

    def close(self) -> None:
        """Close the driver."""
        self._driver.close()
