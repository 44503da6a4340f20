from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.fake_clock import FakeClock

from lobstr_hw.runtime.ticks import Grid, Tick, Ticks

STEP_HZ = 45.0
rates = st.sampled_from([12.0, 15.0, 22.5, 30.0, 45.0, 60.0, 72.0, 90.0, 120.0, 144.0, 500.0])


@pytest.fixture
def clock() -> FakeClock:
    return FakeClock()


def make(clock: FakeClock, rate_hz: float = 45.0, start_s: float = 0.0, **options: object) -> Ticks:
    return Ticks(rate_hz, Grid(rate_hz, STEP_HZ, start_s), start_s, clock, **options)  # type: ignore[arg-type]


@given(rates, st.floats(0.0, 1e5), st.integers(0, 200))
def test_nominal_times_are_counted_from_the_first_tick(rate: float, start: float, n: int) -> None:
    ticks = list(make(FakeClock(), rate, start, last=n))
    assert [tick.index for tick in ticks] == list(range(n + 1))
    assert all(tick.time_s == start + tick.index / rate for tick in ticks)


def test_late_tick_does_not_shift_the_rest(clock: FakeClock) -> None:
    began = clock.now_s()
    ticks = iter(make(clock, 50.0))
    next(ticks)
    clock.advance(0.025)  # longer than a period
    next(ticks)
    assert clock.now_s() == pytest.approx(began + 0.025)  # at once
    next(ticks)
    assert clock.now_s() == pytest.approx(began + 0.040)  # on its own deadline


@given(st.integers(2, 500), st.floats(0.01, 0.99))
def test_a_stall_skips_ticks_and_never_bursts(periods: int, fraction: float) -> None:
    clock = FakeClock()
    rate = 45.0
    ticks = make(clock, rate)
    source = iter(ticks)
    next(source)
    clock.advance((periods + fraction) / rate)
    late = next(source)
    assert late.index == periods
    before = clock.now_s()
    assert next(source).index == periods + 1
    assert clock.now_s() > before  # it waited: the missed ones do not follow in a row
    assert ticks.skipped == periods - 1
    assert ticks.overruns == 1


@given(st.lists(st.floats(0.0, 0.2), min_size=1, max_size=60))
def test_ticks_never_run_early_and_never_go_back(work: list[float]) -> None:
    clock = FakeClock()
    began, rate = clock.now_s(), 45.0
    source = iter(make(clock, rate))
    last = -1
    for seconds in work:
        tick = next(source)
        assert tick.index > last
        assert clock.now_s() >= began + tick.index / rate - 1e-9
        last = tick.index
        clock.advance(seconds)


def test_work_and_lateness_are_recorded(clock: FakeClock) -> None:
    ticks = make(clock, 50.0, last=2)
    for _, seconds in zip(ticks, (0.005, 0.030, 0.001), strict=True):
        clock.advance(seconds)
    assert ticks.work.count == ticks.lateness.count == 3
    assert ticks.work.max_ms == pytest.approx(30.0)
    assert ticks.work.percentile_ms(0.5) == pytest.approx(5.0, rel=0.01)
    assert ticks.lateness.max_ms == pytest.approx(10.0)
    assert ticks.overruns == 1
    assert ticks.skipped == 0


def test_unpaced_ticks_do_not_wait_and_skip_nothing(clock: FakeClock) -> None:
    ticks = make(clock, 45.0, paced=False, last=99)
    seen = []
    for tick in ticks:
        clock.advance(1.0)
        seen.append(tick.index)
    assert seen == list(range(100))
    assert not clock.slept_s
    assert ticks.overruns == 0


def test_stop_ends_before_the_next_tick(clock: FakeClock) -> None:
    seen: list[Tick] = []
    for tick in make(clock, 45.0, stop=lambda: len(seen) == 3):
        seen.append(tick)
    assert len(seen) == 3


@given(rates, st.integers(0, 400))
def test_each_grid_step_is_due_once_and_in_order(rate: float, n: int) -> None:
    start = 7.0
    grid = Grid(rate, STEP_HZ, start, 0.01)
    due = [g for k in range(n + 1) for g in grid.due(k)]
    count = int(Fraction(str(STEP_HZ)) * n / Fraction(str(rate))) + 1
    assert due == [start - 0.01 + j / STEP_HZ for j in range(count)]


@given(rates, st.integers(0, 400))
def test_grid_times_lie_the_delay_behind_their_tick(rate: float, k: int) -> None:
    newest = Grid(rate, STEP_HZ, 0.0, 0.01).due(k)[-1]
    behind = k / rate - newest
    assert 0.01 - 1e-9 <= behind < 0.01 + 1.0 / STEP_HZ


def test_at_most_four_steps_are_made_up_and_they_are_the_newest() -> None:
    grid = Grid(45.0, 45.0, 0.0, 0.0)
    grid.due(0)
    assert grid.due(3) == pytest.approx([1 / 45, 2 / 45, 3 / 45])
    assert grid.due(100) == pytest.approx([97 / 45, 98 / 45, 99 / 45, 100 / 45])
    assert grid.due(101) == pytest.approx([101 / 45])


@pytest.mark.parametrize(
    ("rate", "every"), [(45.0, True), (22.5, True), (90.0, False), (60.0, False)]
)
def test_only_rates_that_divide_the_predictors_are_always_on_the_grid(
    rate: float, every: bool
) -> None:
    assert Grid(rate, 45.0, 0.0).every_tick is every
