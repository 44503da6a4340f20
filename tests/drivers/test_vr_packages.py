"""The VR drivers where their packages are not installed."""

import sys

import pytest

from lobstr_hw.drivers import driver_class, load_driver
from lobstr_hw.errors import DriverUnavailable

MODULES = {"openvr": "openvr", "openxr": "xr"}


@pytest.mark.parametrize(("name", "module"), MODULES.items())
def test_a_missing_package_is_told_with_its_cure(
    name: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)  # as if it were not there
    cure = f"pip install 'lobstr-hw[{name}]'"
    assert driver_class(name).probe().fix == cure
    driver = load_driver(name)
    with pytest.raises(DriverUnavailable) as refusal:
        driver.open()
    assert cure in str(refusal.value)
    assert not driver.poll(1.0)
    assert not driver.devices()
    driver.close()


@pytest.mark.parametrize("name", MODULES)
def test_a_serial_may_be_chosen_for_any_role_but_no_other_option(name: str) -> None:
    load_driver(f"{name}:pelvis=LHR-1,left_foot=LHR-2,head=LHR-3")
    with pytest.raises(ValueError, match="no option 'waist'"):
        load_driver(f"{name}:waist=LHR-1")
