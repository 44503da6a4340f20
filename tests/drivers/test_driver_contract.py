"""The driver contract, run on every driver that needs no device."""

from pathlib import Path

import pytest
from support.driver_contract import Make, RecordedDriverContract

from lobstr_hw.drivers import load_driver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.trackers import TrackingState


@pytest.fixture(scope="session")
def fake_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "fake, 5 s.mcap"
    with load_driver("fake:seed=3") as driver, TrackerLogWriter(path) as writer:
        for device in driver.devices():
            writer.add_state(device.serial, device.role_hint, TrackingState.OK, True, 0.0)
        writer.add_samples(driver.poll(5.0))
    return path


@pytest.fixture(params=["fake", "replay"])
def make(request: pytest.FixtureRequest, fake_log: Path) -> Make:
    specs = {"fake": "fake:seed=3", "replay": f"replay:file={fake_log}"}
    return lambda: load_driver(specs[request.param])


class TestFakeAndReplay(RecordedDriverContract):
    """All of it is inherited."""
