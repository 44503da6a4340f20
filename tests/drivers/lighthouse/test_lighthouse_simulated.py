"""The bars of tracking on libsurvive's simulated sets, whose truth is exact."""

import os
from pathlib import Path

import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")
tool = pytest.importorskip("lighthouse_sim")

ROOT = Path(__file__).parents[3]
SETS = Path(os.environ.get("LOBSTR_DATA", ROOT.parent / "shared" / "data")) / "lighthouse" / "sim"
NAMES = ["lh1_clean_a", "lh1_noisy_a", "lh2_clean_a", "lh2_noisy_a"]
BARS = {"clean": (0.5, 0.05), "noisy": (2.0, 0.3)}
"""Median errors, mm and degrees; the 95th percentile may be three times as large."""


def path_of(name: str) -> Path:
    path = SETS / f"{name}.json"
    if not path.exists():
        pytest.skip("set LOBSTR_DATA to the folder that holds lighthouse/ to run this")
    return path


@pytest.mark.parametrize("name", NAMES)
def test_with_stations_given_the_errors_are_within_the_bar(name: str) -> None:
    mm, degrees = BARS[name.split("_")[1]]
    s = tool.score(tool.read_set(path_of(name)), solve=False)
    assert s.mm < mm and s.degrees < degrees
    assert s.mm_95 < 3 * mm and s.degrees_95 < 3 * degrees
    assert s.tracked > 0.9


@pytest.mark.parametrize("name", ["lh1_noisy_a"])
def test_with_stations_solved_from_the_set_itself_too(name: str) -> None:
    mm, degrees = BARS[name.split("_")[1]]
    s = tool.score(tool.read_set(path_of(name)), solve=True)
    assert s.mm < 2 * mm and s.degrees < 2 * degrees
    assert abs(s.scale) < 0.005
    assert s.gravity_degrees < 0.3


def test_the_worlds_convert_there_and_back() -> None:
    p, R = tool.y_up_from_z_up([0.0, 0.0, 1.0])
    assert p.tolist() == [0.0, 1.0, 0.0]
    assert (R.T @ p).tolist() == [0.0, 0.0, 1.0]
