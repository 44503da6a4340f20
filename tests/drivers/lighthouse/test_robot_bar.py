"""Two trackers on a robot's bar, which nobody can bend (LOBSTR_DATA names the folder of data)."""

import os
from pathlib import Path

import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from robot_bar import compare, is_within

from lobstr_hw.drivers.lighthouse.recorded_tracking import read_takes, solve_takes


@pytest.fixture(scope="module")
def folder() -> Path:
    named = Path(os.environ.get("LOBSTR_DATA", "none")) / "lighthouse"
    found = sorted(named.glob("robot-bar*"))
    if not found:
        pytest.skip("set LOBSTR_DATA to the folder that holds lighthouse/ to run this")
    return found[0]


def test_the_distance_of_two_trackers_on_a_bar_is_one(folder: Path) -> None:
    stations = solve_takes(read_takes(folder / "dyn_set1_run1.rec.gz")).stations
    for path in sorted(folder.glob("*.rec.gz")):
        bar = compare(read_takes(path), stations, path.name)
        assert is_within(bar), bar
        assert bar.std_mm < 1.0
        assert bar.compared > 0.95
