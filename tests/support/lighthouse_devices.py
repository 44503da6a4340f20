"""Lighthouse devices of a made-up room on the fake USB bus, for tests of the driver."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from support.fake_clock import FakeClock
from support.fake_transport import FakeTransport, FakeUsbDevice
from support.lighthouse_room import device
from support.lighthouse_wire import FIRST_TICK, TimedReport, config_of
from support.scripted_usb import CONFIG_PIECE, CONFIG_START, ScriptedDevice
from support.waiting import wait_until

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, DeviceModel
from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.reading_thread import Notice
from lobstr_hw.trackers import TrackerSample

__all__ = ["Bench", "HandedOut", "named", "scripted_device"]

VALVE, BY_CONFIG = 0x28DE, 0x2300
ENDS = (0x81, 0x83, 0x84)
RANGES = bytes([0x01, 3, 2])
"""2000 degrees per second, 8 g."""
VERSION = bytes([5]) + (0x5F12AB34).to_bytes(4, "little") + bytes(48)
PIECE = 62


def named(
    serial: str, device_class: str = "generic_tracker", model: str = "made up"
) -> DeviceModel:
    """A device like those of the room, by its name."""
    return replace(device(), serial=serial, device_class=device_class, model=model)


def scripted_device(
    model: DeviceModel, reports: Sequence[TimedReport], address: int = 2
) -> ScriptedDevice:
    """What the device answers and sends by cable."""
    config = config_of(model)
    pieces = [config[k : k + PIECE] for k in range(0, len(config), PIECE)]
    features = {
        0x01: [RANGES],
        0x05: [VERSION],
        CONFIG_START: [bytes([CONFIG_START]) + len(config).to_bytes(2, "big")],
        CONFIG_PIECE: [bytes([CONFIG_PIECE, len(p)]) + p for p in [*pieces, b""]],
    }
    played = [((r.ticks - FIRST_TICK) / TICKS_PER_S, r.interface, r.data) for r in reports]
    return ScriptedDevice(
        VALVE, BY_CONFIG, address, f"USB{address}", model.model, ENDS, features, played
    )


class HandedOut(FakeUsbDevice):
    """A device that counts how often it had nothing to say.

    Attributes:
        nothing: reads in vain: whoever reads has worked through all that came before.
    """

    nothing = 0

    def take(self):  # type: ignore[no-untyped-def]
        report = super().take()
        self.nothing += report is None
        return report


class Bench:
    """The driver and a clock that only the test moves: the same on every run."""

    def __init__(
        self,
        devices: Sequence[ScriptedDevice],
        clock: FakeClock,
        make: Callable[[FakeTransport], LighthouseDriver],
    ) -> None:
        self.clock = clock
        self.devices = [HandedOut(script, clock) for script in devices]
        self.transport = FakeTransport(self.devices)
        self.driver = make(self.transport)
        self._marks = 0
        self._poll = self.driver.poll

    def settle(self) -> None:
        """Wait until all that came by now has been worked through."""
        hub, thread = self.driver._hub, self.driver._thread
        assert hub is not None and thread is not None
        followed = {key for key, s in dict(hub._sessions).items() if s.tracked is not None}
        read = {d: d.nothing for d in self.devices if d.opened and d.info.key in followed}
        wait_until(
            lambda: all(d.nothing > n + 1 or not d.plugged for d, n in read.items()),
            "devices are read",
            60.0,
        )
        self._marks += 1
        mark = Notice(f"mark {self._marks}")
        hub._inbox.put(mark)
        wait_until(lambda: any(what is mark for _, what in list(thread._arrivals)), "sorted", 60.0)

    def run_to(self, end_s: float, step_s: float = 1 / 45) -> list[TrackerSample]:
        """Go on to a time as the runtime does, poll by poll."""
        samples: list[TrackerSample] = []
        while self.clock.now_s() < end_s - 1e-9:
            self.clock.advance(min(step_s, end_s - self.clock.now_s()))
            samples += self.poll(self.clock.now_s())
        return samples

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """The driver's samples, after all that came by now has been worked through."""
        self.settle()
        return self._poll(now_s)

    def words(self) -> list[str]:
        """The driver's words for its user since the last call."""
        return [e.name for e in self.driver.events() if e.kind == "notice" and "mark" not in e.name]
