"""The whole live loop on SteamVR and on OpenXR, both faked behind their real packages."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from support import openxr_bed, steamvr_bed
from support.fake_clock import FakeClock

from lobstr_hw.drivers import load_driver
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.trackers import TrackerRole

pytestmark = pytest.mark.bed

OPTIONS = LiveOptions(predictor="standing", duration_s=4.0, quiet=True)
STEAMVR_QUITS, OPENXR_INSTANCE_ENDS = 700, 17


@dataclass
class Bed:
    """A VR runtime with the four devices of the paper."""

    driver: str
    move: Callable[[int, Array, Array], None]
    quit: Callable[[], None]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runtimes")


@pytest.fixture(scope="module")
def steamvr_registry(folder: Path) -> Path:
    return steamvr_bed.build_runtime(folder / "steamvr")


@pytest.fixture(scope="module")
def openxr_manifest(folder: Path) -> Path:
    return openxr_bed.build_runtime(folder / "openxr")


@pytest.fixture
def steamvr(steamvr_registry: Path, tmp_path: Path) -> Iterator[Bed]:
    with steamvr_bed.running_steamvr(steamvr_registry, tmp_path / "stage") as runtime:
        runtime.add(0, steamvr_bed.HEADSET, "LHR-HEAD", "vive")
        runtime.add(1, steamvr_bed.CONTROLLER, "LHR-LEFT", "vive_controller", steamvr_bed.LEFT)
        runtime.add(2, steamvr_bed.CONTROLLER, "LHR-RIGHT", "vive_controller", steamvr_bed.RIGHT)
        runtime.add(3, steamvr_bed.TRACKER, "LHR-WAIST", "vive_tracker_waist")
        yield Bed("openvr", runtime.move, lambda: runtime.raise_event(STEAMVR_QUITS))


@pytest.fixture
def openxr(openxr_manifest: Path, tmp_path: Path) -> Iterator[Bed]:
    with openxr_bed.running_openxr(openxr_manifest, tmp_path / "stage") as runtime:
        waist = f"{openxr_bed.TRACKER_ROLE}waist"
        for index, path in enumerate((openxr_bed.HEAD, openxr_bed.LEFT, openxr_bed.RIGHT)):
            runtime.add(index, path)
        runtime.add(3, waist, "/devices/htc/vive_trackerLHR-WAIST")
        yield Bed("openxr", runtime.move, lambda: runtime.send(OPENXR_INSTANCE_ENDS))


@pytest.fixture(params=["steamvr", "openxr"])
def bed(request: pytest.FixtureRequest) -> Bed:
    """Somebody stands there in a T-pose."""
    found: Bed = request.getfixturevalue(request.param)
    with FakeDriver() as person:
        for index, sample in enumerate(person.poll(0.0)):
            assert sample.T_world_tracker.p is not None
            found.move(index, sample.T_world_tracker.R, sample.T_world_tracker.p)
    return found


def test_a_t_pose_on_a_vr_runtime_calibrates_and_goes_on(bed: Bed) -> None:
    with LiveSession(load_driver(bed.driver), OPTIONS, print, FakeClock()) as live:
        live.run(lambda: False)
    assert live.session.calibrated
    summary = live.summary()
    assert summary.frames == 4 * 45 + 1
    assert summary.nonfinite_frames == 0
    assert summary.gate_events == {}
    assert set(summary.tracker_loss.values()) == {0.0}


def test_a_runtime_that_quits_leaves_the_body_standing(bed: Bed) -> None:
    clock = FakeClock(0.0)
    quit_at = [3.0]

    def stop() -> bool:
        if quit_at and clock.now_s() >= quit_at[0]:
            quit_at.clear()
            bed.quit()
        return False

    with LiveSession(load_driver(bed.driver), OPTIONS, print, clock) as live:
        live.run(stop)
    summary = live.summary()
    assert live.session.calibrated
    assert summary.frames == 4 * 45 + 1
    assert summary.nonfinite_frames == 0
    assert summary.tracker_loss[TrackerRole.HEAD] == pytest.approx(0.9, abs=0.1)
