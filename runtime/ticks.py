"""When the loop runs, and at which times the predictor steps (design: three rates, never mixed).

Tick k has the nominal time ``t_k = t_0 + k / rate``; the wall clock only decides when it runs. The
predictor's grid is ``g_j = t_0 - d + j / 45``; tick k runs the steps up to ``floor(45 k / rate)``.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

from lobstr_hw.runtime.clock import Clock
from lobstr_hw.runtime.durations import Durations

__all__ = ["INPUT_DELAY_S", "Grid", "Tick", "Ticks"]

INPUT_DELAY_S = 0.010
"""Of the grid behind the ticks: by then the samples around a grid time have arrived. Without it,
extrapolation errors of a fifth of the hand's speed reach the network."""

CATCH_UP = 4
"""Late grid steps that are made up; after a longer gap only the newest four run."""


@dataclass(frozen=True, slots=True)
class Tick:
    """One turn of the loop.

    Attributes:
        index: k; a skipped tick leaves a hole.
        time_s: nominal, t_k.
        grid_s: the grid times due by this tick, oldest first, at most four.
    """

    index: int
    time_s: float
    grid_s: tuple[float, ...]


class Grid:
    """The times of the predictor's own steps, counted in integers so that they never drift."""

    def __init__(
        self, rate_hz: float, step_hz: float, start_s: float, delay_s: float = INPUT_DELAY_S
    ) -> None:
        """Lay the grid.

        Args:
            rate_hz: of the loop.
            step_hz: of the predictor (its card).
            start_s: t_0.
            delay_s: d.
        """
        self.step_hz = step_hz
        self.first_s = start_s - delay_s
        self.steps_per_tick = Fraction(str(step_hz)) / Fraction(str(rate_hz))
        self._last = -1

    @property
    def every_tick(self) -> bool:
        """Whether each tick is exactly on the grid, so that nothing lies between two steps."""
        return self.steps_per_tick.denominator == 1

    def newest(self, tick: int) -> int:
        """The last grid index due by a tick: floor(45 k / rate)."""
        ratio = self.steps_per_tick
        return tick * ratio.numerator // ratio.denominator

    def due(self, tick: int) -> tuple[float, ...]:
        """The grid times since the last call, at most the newest four."""
        newest = self.newest(tick)
        first = max(self._last + 1, newest - CATCH_UP + 1)
        self._last = newest
        return tuple(self.first_s + j / self.step_hz for j in range(first, newest + 1))


class Ticks:
    """Iterates over the ticks of a session and keeps count of how well they were met.

    Deadlines are absolute: one late tick does not push back the rest, and after a long stall the
    ticks that were missed are skipped, never run in a burst.

    Attributes:
        overruns: ticks whose work was not done by the next one's deadline.
        skipped: ticks that never ran.
        work: how long ticks took.
        lateness: how long after their deadlines they began (nothing when not paced).
    """

    def __init__(
        self,
        rate_hz: float,
        grid: Grid,
        start_s: float,
        clock: Clock,
        *,
        paced: bool = True,
        last: int | None = None,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Get ready; the clock is read at the first tick.

        Args:
            rate_hz: ticks per second.
            grid: of the predictor.
            start_s: nominal time of the first tick (a log's time, or the clock's).
            clock: paces the ticks and measures their work.
            paced: False runs as fast as possible on nominal time alone.
            last: index of the last tick; None goes on until ``stop``.
            stop: asked before every tick.
        """
        self.rate_hz = rate_hz
        self.grid = grid
        self.start_s = start_s
        self.clock = clock
        self.paced = paced
        self.last = last
        self.stop = stop
        self.overruns = 0
        self.skipped = 0
        self.work = Durations()
        self.lateness = Durations()

    def __iter__(self) -> Iterator[Tick]:
        """Each tick when it is due; one pass only."""
        began_s = self.clock.now_s()
        k = 0
        while not self._over(k):
            if self.paced:
                self._wait(began_s + k / self.rate_hz)
                if self.stop():
                    return
            started_s = self.clock.now_s()
            yield Tick(k, self.start_s + k / self.rate_hz, self.grid.due(k))
            done_s = self.clock.now_s()
            self.work.add(1e3 * (done_s - started_s))
            k = self._next(k, done_s - began_s) if self.paced else k + 1

    def _over(self, k: int) -> bool:
        return self.stop() or (self.last is not None and k > self.last)

    def _wait(self, deadline_s: float) -> None:
        self.clock.sleep(deadline_s - self.clock.now_s())
        self.lateness.add(1e3 * max(0.0, self.clock.now_s() - deadline_s))

    def _next(self, k: int, elapsed_s: float) -> int:
        """The tick after k: the newest that is due already, or else k + 1."""
        due = int(elapsed_s * self.rate_hz)
        if due > k:
            self.overruns += 1
        self.skipped += max(0, due - k - 1)
        return max(k + 1, due)
