"""Drivers that do what no driver should, for programs that must go on all the same."""

import threading
from collections.abc import Sequence

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, Probe, TrackerDriver
from lobstr_hw.errors import DeviceBusy
from lobstr_hw.trackers import TrackerSample


class QuietDriver(TrackerDriver):
    """There, and nothing else."""

    @classmethod
    def probe(cls) -> Probe:
        return Probe(available=True)

    def open(self) -> None:
        """Nothing to claim."""

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        return ()

    def devices(self) -> Sequence[DeviceInfo]:
        return ()

    def events(self) -> Sequence[DeviceEvent]:
        return ()

    def close(self) -> None:
        """Nothing to release."""


class HangingDriver(QuietDriver):
    """Opening does not come back until somebody lets go."""

    let_go = threading.Event()

    def open(self) -> None:
        self.let_go.wait()


class BrokenProbeDriver(QuietDriver):
    """Has a fault where nothing should be able to go wrong."""

    probes = 0

    @classmethod
    def probe(cls) -> Probe:
        cls.probes += 1
        raise RuntimeError("ouch")


class BrokenPollDriver(QuietDriver):
    """Opens, and falls over at the first poll."""

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        raise ZeroDivisionError("no samples per second")


class BusyDriver(QuietDriver):
    """Another program has it."""

    def open(self) -> None:
        raise DeviceBusy("the dongle is in use. Close the other program.")


class MissingDriver(QuietDriver):
    """Lacks something."""

    @classmethod
    def probe(cls) -> Probe:
        return Probe(False, "the Python package snake", "pip install snake")


class UnopenedDriver(QuietDriver):
    """Must not be opened unasked."""

    opened = 0

    def open(self) -> None:
        type(self).opened += 1
