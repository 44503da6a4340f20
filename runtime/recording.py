"""Recording: what the drivers give, with time and serial, and nothing else."""

from collections.abc import Callable
from dataclasses import dataclass

from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.runtime.clock import Clock
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.notices import notices
from lobstr_hw.runtime.one_space import SPACES
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["Recorder", "TrackerTally"]

GAP_S = 0.1
"""So long without a sample is a drop-out: the runtime does not believe an older pose either."""
DEVICES_S = 1.0
"""How often batteries and roles are asked for; they change in minutes."""


@dataclass(slots=True)
class TrackerTally:
    """What is known of one tracker.

    Attributes:
        role: the body part, where it is known.
        battery: 0 to 1, or None.
        samples: how many there were.
        dropouts: times without sight, or without samples.
        lost_s: all of them together.
        newest: the last sample.
    """

    role: TrackerRole | None = None
    battery: float | None = None
    samples: int = 0
    dropouts: int = 0
    lost_s: float = 0.0
    newest: TrackerSample | None = None
    _lost: bool = False

    def add(self, sample: TrackerSample) -> None:
        """Count a sample, and the time since the one before."""
        if self.newest is not None:
            since_s = sample.time_s - self.newest.time_s
            lost = not self.newest.tracked or since_s > GAP_S
            self.dropouts += lost and not self._lost
            self.lost_s += since_s if lost else 0.0
            self._lost = lost
        self.samples += 1
        self.newest = sample


class Recorder:
    """Moves samples from an open driver to an open log.

    Attributes:
        trackers: by serial, in the order of their first samples.
        elapsed_s: since the first poll.
        late: polls that could not be made when they were due.
    """

    def __init__(
        self,
        driver: TrackerDriver,
        writer: TrackerLogWriter,
        table: RoleTable,
        clock: Clock,
        rate_hz: float,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        """Get ready.

        Args:
            driver: open.
            writer: open.
            table: serial -> role.
            clock: of the samples' times.
            rate_hz: how often the driver is asked; a driver without times of its own gives that
                many samples.
            tell: is given the drivers' words for the user.
        """
        self.trackers: dict[str, TrackerTally] = {}
        self.elapsed_s = 0.0
        self.late = 0
        self._driver, self._writer, self._table = driver, writer, table
        self._clock, self._rate_hz = clock, rate_hz
        self._asked_s = -float("inf")
        self._tell = tell or (lambda words: None)

    def run(self, stop: Callable[[], bool], duration_s: float | None = None) -> None:
        """Go on until ``stop``, or for so long.

        Raises:
            OSError: the log cannot be written any more; what was written stays.
        """
        began_s = self._clock.now_s()
        self._writer.mark_clock(self._clock.unix_s() - began_s)
        k = 0
        while not stop() and (duration_s is None or self.elapsed_s < duration_s):
            now_s = self._clock.now_s()
            self.step(now_s)
            self.elapsed_s = now_s - began_s
            due = int((self._clock.now_s() - began_s) * self._rate_hz)
            self.late += max(0, due - k - 1)
            k = max(k + 1, due)
            self._clock.sleep(began_s + k / self._rate_hz - self._clock.now_s())

    def step(self, now_s: float) -> None:
        """What was measured up to now; all of it is with the operating system afterwards."""
        samples = self._driver.poll(now_s)
        new: dict[str, TrackerSample] = {}
        for sample in samples:
            if sample.serial not in self.trackers:
                self.trackers[sample.serial], new[sample.serial] = TrackerTally(), sample
        if new or now_s - self._asked_s >= DEVICES_S:
            self._ask_devices(now_s)
        if new and isinstance(self._driver, ManyDrivers):
            self._writer.metadata(SPACES, self._spaces(self._driver))
        events = self._driver.events()
        for words in notices(events):
            self._tell(words)
        for serial, first in new.items():  # a tracker's state stands before its first pose
            self._write_state(serial, first.time_s, first)
        for event in events:
            self._writer.add_event(event)
        for sample in samples:
            self.trackers[sample.serial].add(sample)
        self._writer.add_samples(samples)

    def _ask_devices(self, now_s: float) -> None:
        self._asked_s = now_s
        batteries = {device.serial: device.battery for device in self._driver.devices()}
        for serial, tally in self.trackers.items():
            before = (tally.role, tally.battery)
            tally.role = self._table.of(serial)
            tally.battery = batteries.get(serial, tally.battery)
            if before != (tally.role, tally.battery):
                self._write_state(serial, now_s)

    def _spaces(self, driver: ManyDrivers) -> dict[str, str]:
        """Samples are kept as the drivers gave them, so a replay has to know whose each is."""
        return {serial: driver.space_of(serial) or "" for serial in self.trackers}

    def _write_state(self, serial: str, time_s: float, sample: TrackerSample | None = None) -> None:
        tally = self.trackers[serial]
        sample = sample or tally.newest
        if sample is None:  # comes with the first sample
            return
        self._writer.add_state(
            serial,
            tally.role,
            sample.state,
            sample.tracked,
            time_s,
            tally.battery,
            self._writer.buttons(serial),
        )
