import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lobstr_hw.runtime.durations import Durations


@given(st.lists(st.floats(2e-3, 1e5), min_size=1, max_size=200), st.floats(0.0, 1.0))
def test_percentiles_are_right_to_one_per_cent(values: list[float], share: float) -> None:
    durations = Durations()
    for value in values:
        durations.add(value)
    exact = np.quantile(values, share, method="inverted_cdf")
    assert durations.percentile_ms(share) == pytest.approx(exact, rel=0.011)
    assert durations.max_ms == max(values)
    assert durations.count == len(values)


def test_without_any_there_are_none() -> None:
    assert Durations().summary_ms() == {"p50": None, "p99": None, "max": None}


def test_what_is_out_of_range_is_kept_in_the_last_bins() -> None:
    durations = Durations()
    for value in (0.0, 1e-9, 1e12):
        durations.add(value)
    assert durations.count == 3
    assert durations.max_ms == 1e12
