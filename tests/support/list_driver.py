"""A driver that says what it was given."""

from collections.abc import Mapping, Sequence

from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, Probe, TrackerDriver
from lobstr_hw.trackers import TrackerRole, TrackerSample


class ListDriver(TrackerDriver):
    """Samples by their time, in the order given."""

    def __init__(
        self, samples: Sequence[TrackerSample], hints: Mapping[str, TrackerRole | None]
    ) -> None:
        self.left = list(samples)
        self.hints = dict(hints)
        self.closed = 0

    @classmethod
    def probe(cls) -> Probe:
        return Probe(available=True)

    def open(self) -> None:
        """Nothing to claim."""

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        due = [sample for sample in self.left if not sample.time_s > now_s]  # NaN is due
        self.left = [sample for sample in self.left if sample.time_s > now_s]
        return due

    def devices(self) -> Sequence[DeviceInfo]:
        return [
            DeviceInfo(serial, "tracker", role_hint=role) for serial, role in self.hints.items()
        ]

    def events(self) -> Sequence[DeviceEvent]:
        return ()

    def close(self) -> None:
        self.closed += 1
