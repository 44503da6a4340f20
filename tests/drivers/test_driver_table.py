"""Naming drivers."""

import subprocess
import sys

import pytest

from lobstr_hw.drivers import DRIVERS, driver_class, load_driver, split_driver_spec
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.replay import ReplayDriver


@pytest.mark.parametrize("name", sorted(DRIVERS))
def test_every_name_leads_to_a_driver(name: str) -> None:
    assert issubclass(driver_class(name), TrackerDriver)


def test_an_unknown_name_lists_the_known_ones() -> None:
    known = ", ".join(sorted(DRIVERS))
    with pytest.raises(ValueError, match=f"no driver is called 'vive'; known: {known}$"):
        load_driver("vive")


def test_an_unknown_option_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match="no option 'speed'; known: file"):
        load_driver("replay:file=a.mcap,speed=2")


def test_a_value_of_the_wrong_kind_is_named() -> None:
    with pytest.raises(ValueError, match="seed='x' is not a int"):
        load_driver("fake:seed=x")


def test_a_missing_option_is_named() -> None:
    with pytest.raises(ValueError, match="needs more options, of: file="):
        load_driver("replay")


@pytest.mark.parametrize("spec", ["fake:seed", "fake:=3", "fake:seed=1,seed=2"])
def test_what_is_no_key_and_value_is_refused(spec: str) -> None:
    with pytest.raises(ValueError, match="is not one key=value"):
        load_driver(spec)


@pytest.mark.parametrize("path", [r"C:\takes\a.mcap", "a,b.mcap", "a=b.mcap", "a, b:c.mcap"])
def test_a_file_name_may_hold_colons_commas_and_equals(path: str) -> None:
    driver = load_driver(f"replay:file={path}")
    assert isinstance(driver, ReplayDriver)
    assert str(driver.path) == path


def test_options_of_the_runtime_are_split_off_but_not_handed_on() -> None:
    spec = "fake:seed=1,role=pelvis,name=hip"
    assert split_driver_spec(spec) == ("fake", {"seed": "1", "role": "pelvis", "name": "hip"})
    load_driver(spec)


def test_looking_at_the_table_imports_no_driver() -> None:
    code = "import sys, lobstr_hw.drivers; print([m for m in sys.modules if '.replay' in m])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
