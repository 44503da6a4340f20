"""A clock that moves only when told."""


class FakeClock:
    """Obeys the contract of ``lobstr_hw.runtime.clock.Clock`` without waiting."""

    def __init__(self, now_s: float = 100.0) -> None:
        self.time_s = now_s
        self.slept_s: list[float] = []

    def now_s(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        self.slept_s.append(seconds)
        self.time_s += max(seconds, 0.0)

    def unix_s(self) -> float:
        return 1.7e9 + self.time_s

    def advance(self, seconds: float) -> None:
        """Work that takes this long."""
        self.time_s += seconds
