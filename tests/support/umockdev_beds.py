"""Test beds of umockdev: run tests once more with a made-up device in the system."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from support.beds import need

__all__ = ["run_in_bed"]

SYSTEM_PYTHON = Path("/usr/bin/python3")
SUPPORT = Path(__file__).parent
APT = "apt-get install umockdev gir1.2-umockdev-1.0 python3-gi"


def _has_umockdev() -> bool:
    code = "import gi; gi.require_version('UMockdev', '1.0')"
    command = [str(SYSTEM_PYTHON), "-c", code]
    return SYSTEM_PYTHON.exists() and subprocess.run(command, capture_output=True).returncode == 0


def run_in_bed(bed: str, arguments: Sequence[str], tests: Path) -> None:
    """Run a test file in a bed of this folder, and fail with what it printed."""
    need("Linux", "run this test on Linux", sys.platform == "linux")
    need("umockdev for the system's Python", APT, _has_umockdev())
    inner = [sys.executable, "-m", "pytest", "-q", "-m", "bed or not bed", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [str(SYSTEM_PYTHON), str(SUPPORT / bed), *arguments, *inner, str(tests)],
        capture_output=True,
        text=True,
        timeout=600,
    )
    if done.returncode:
        pytest.fail(done.stdout + done.stderr, pytrace=False)
