"""A transport without USB: scripted devices, at once or paced on a fake clock, with faults."""

from collections.abc import Sequence

from support.fake_clock import FakeClock
from support.scripted_usb import FeatureAnswers, ScriptedDevice

from lobstr_hw.drivers.driver import Probe
from lobstr_hw.drivers.lighthouse.transport import (
    FEATURE_BYTES,
    LinkLost,
    NoAnswer,
    RawReport,
    UsbDeviceInfo,
)
from lobstr_hw.drivers.lighthouse.usb_ids import DeviceKind, kind_of
from lobstr_hw.errors import DeviceBusy, DriverError, TrackerNotFound

__all__ = ["FakeOpenDevice", "FakeTransport", "FakeUsbDevice"]


class FakeUsbDevice:
    """One device on the fake bus; a test steers it.

    Attributes:
        script: what it answers and sends, from the beginning each time it is plugged in.
        answers: feature reports; has the faults.
        plugged: the system lists it.
        refusal: what opening it raises, or None.
        held_back: reports wait for ``play``, however late it is.
        opened: how many hold it open now; 0 when all is well at the end.
    """

    def __init__(self, script: ScriptedDevice, clock: FakeClock | None = None) -> None:
        """Plugged in; ``clock``: reports come when they are due, or None: at once."""
        self.script, self._clock = script, clock
        self.refusal: DriverError | None = None
        self.opened = 0
        self.held_back = False
        self.plug()

    def plug(self) -> None:
        """It is plugged in, and begins anew."""
        self.plugged = True
        self.answers = FeatureAnswers(self.script.features)
        self._next, self._allowed = 0, 0
        self._since_s = self._clock.now_s() if self._clock else 0.0
        self._extra: list[RawReport] = []
        self.plugs = getattr(self, "plugs", 0) + 1

    def unplug(self) -> None:
        """It is gone; what it sent and nobody read is lost."""
        self.plugged = False

    def play(self, count: int) -> None:
        """Let so many more reports come; for a device that is held back."""
        self._allowed += count

    def put(self, data: bytes, interface: int = 0) -> None:
        """Send a report that is not in the script, before all others."""
        self._extra.append(RawReport(interface, data, self._now_s()))

    @property
    def remaining(self) -> int:
        """Reports of the script that were not read."""
        return len(self.script.reports) - self._next

    def take(self) -> RawReport | None:
        """The next report that is due."""
        if self._extra:
            return self._extra.pop(0)
        if not self.remaining or (self.held_back and self._next >= self._allowed):
            return None
        time_s, interface, data = self.script.reports[self._next]
        due_s = self._since_s + time_s - self.script.reports[0][0]
        if self._clock is not None and due_s > self._clock.now_s():
            return None
        self._next += 1
        return RawReport(interface, data, due_s if self._clock else self._now_s())

    def _now_s(self) -> float:
        return self._clock.now_s() if self._clock else 0.0

    @property
    def info(self) -> UsbDeviceInfo:
        """As the system lists it."""
        s = self.script
        return UsbDeviceInfo(
            vendor_id=s.vendor,
            product_id=s.product,
            serial=s.serial,
            kind=kind_of(s.vendor, s.product) or DeviceKind.UNKNOWN,
            key=f"1-{s.address}",
            interfaces=tuple((i, b"fake") for i in range(len(s.ends))),
            product=s.name,
        )


class FakeOpenDevice:
    """An open one; keeps to ``OpenDevice``."""

    dropped = 0

    def __init__(self, device: FakeUsbDevice) -> None:
        self._device, self.info = device, device.info
        self._plugs, self._open = device.plugs, True
        device.opened += 1

    def _check(self) -> None:
        if not self._open:
            raise LinkLost("closed")
        if not self._device.plugged or self._device.plugs != self._plugs:
            raise LinkLost("unplugged")

    def read(self, timeout_s: float) -> RawReport | None:
        """Never waits: a fake clock does not go on by itself."""
        self._check()
        return self._device.take()

    def get_feature(self, report_id: int, length: int = FEATURE_BYTES) -> bytes:
        self._check()
        answer = self._device.answers.get(report_id)
        if not answer:
            raise NoAnswer(f"{self.info.name}: feature report {report_id:02x} is refused (STALL)")
        return answer[:length]

    def send_feature(self, data: bytes) -> None:
        self._check()
        if not self._device.answers.set(data):
            raise NoAnswer(f"{self.info.name}: feature report {data[0]:02x} is refused (STALL)")

    def close(self) -> None:
        self._device.opened -= self._open
        self._open = False


class FakeTransport:
    """The fake bus; keeps to ``Transport``."""

    name = "fake"

    def __init__(self, devices: Sequence[FakeUsbDevice]) -> None:
        self.devices = list(devices)
        self.missing: DriverError | None = None

    def probe(self) -> Probe:
        if self.missing is None:
            return Probe(available=True)
        return Probe(available=False, missing=str(self.missing), fix="none")

    def enumerate(self) -> Sequence[UsbDeviceInfo]:
        if self.missing is not None:
            raise self.missing
        return [device.info for device in self.devices if device.plugged]

    def open(self, info: UsbDeviceInfo) -> FakeOpenDevice:
        for device in self.devices:
            if device.plugged and device.info.key == info.key:
                if device.refusal is not None:
                    raise device.refusal
                if device.opened:
                    raise DeviceBusy(f"{info.name} is opened twice")
                return FakeOpenDevice(device)
        raise TrackerNotFound(f"{info.name} is not there any more: plug it in again")
