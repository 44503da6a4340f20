"""The Ultimate Trackers' driver behind the real hidapi: a device node made by umockdev."""

import importlib.util
from pathlib import Path

import pytest
from support.beds import need
from support.umockdev_beds import run_in_bed


@pytest.mark.bed
def test_all_of_its_tests_hold_on_a_device_node() -> None:
    has_hidapi = importlib.util.find_spec("hidraw") is not None
    need("hidapi", "pip install 'lobstr-hw[hid]'", has_hidapi)
    run_in_bed("hidraw_testbed.py", [], Path(__file__).with_name("test_ultimate.py"))
