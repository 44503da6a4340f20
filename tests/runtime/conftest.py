"""Logs that several tests replay."""

from pathlib import Path

import pytest
from support.made_logs import made_take, write_log

from lobstr_hw.simulation import SimulatedTake


@pytest.fixture(scope="session")
def take() -> SimulatedTake:
    return made_take()


@pytest.fixture(scope="session")
def log(take: SimulatedTake, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A T-pose of 2 s and a walk of 2 s."""
    return write_log(tmp_path_factory.mktemp("logs") / "walk.mcap", take)
