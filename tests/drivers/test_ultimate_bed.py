"""The Ultimate Trackers' driver behind the real hidapi: a device node made by umockdev."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
from support.beds import need

SYSTEM_PYTHON = Path("/usr/bin/python3")
TESTBED = Path(__file__).parent.parent / "support" / "hidraw_testbed.py"
APT = "apt-get install umockdev gir1.2-umockdev-1.0 python3-gi"


def has_umockdev() -> bool:
    code = "import gi; gi.require_version('UMockdev', '1.0')"
    command = [str(SYSTEM_PYTHON), "-c", code]
    return SYSTEM_PYTHON.exists() and subprocess.run(command, capture_output=True).returncode == 0


@pytest.mark.bed
def test_all_of_its_tests_hold_on_a_device_node() -> None:
    need("Linux", "run this test on Linux", sys.platform == "linux")
    need("umockdev for the system's Python", APT, has_umockdev())
    has_hidapi = importlib.util.find_spec("hidraw") is not None
    need("hidapi", "pip install 'lobstr-hw[hid]'", has_hidapi)
    inner = Path(__file__).with_name("test_ultimate.py")
    pytest_command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(inner)]
    done = subprocess.run(
        [str(SYSTEM_PYTHON), str(TESTBED), *pytest_command],
        capture_output=True,
        text=True,
        timeout=150,
    )
    assert done.returncode == 0, done.stdout + done.stderr
