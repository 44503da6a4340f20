"""From the reports of four devices on a fake bus to a skeleton: the whole way, nothing left out."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from support.fake_clock import FakeClock
from support.lighthouse_devices import Bench, named, scripted_device
from support.lighthouse_room import Motion, room
from support.lighthouse_wire import reports_of

from lobstr_hw.drivers import fake, reading_thread, stream
from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.lighthouse.station_file import save_stations
from lobstr_hw.rotations import Array, to_rotation_vector
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.skeleton_pose import SkeletonPose, Source
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

SECONDS, T_POSE_S = 2.9, 2.0
DEVICES = (
    named("LHR-0000000H", "hmd", "Vive MV"),
    named("LHR-0000000L", "controller", "Vive Controller MV"),
    named("LHR-0000000R", "controller", "Vive Controller MV"),
    named("LHR-0000000P", "generic_tracker", "VIVE Tracker Pro MV"),
)
BODY = Body.standard(1, 170.0 / 170.6)


def worn(k: int) -> Motion:
    """What the fake person does with one of the four devices: a T-pose, then the arms go down."""

    def poses(t: Array) -> tuple[Array, Array]:
        p, R = fake._trackers(*fake._joints(t, BODY), BODY)
        return p[:, k], R[:, k]

    return Motion(lambda t: poses(t)[0], lambda t: to_rotation_vector(poses(t)[1]))


class Watching:
    """Keeps the skeletons."""

    def __init__(self) -> None:
        self.poses: list[SkeletonPose] = []

    def send(self, pose: SkeletonPose, samples: Sequence[TrackerSample]) -> None:
        self.poses.append(pose)

    def calibrated(self, body: Body) -> None:
        pass


def test_a_t_pose_before_base_stations_makes_a_skeleton_that_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, stations = FakeClock(0.0), room(2)
    monkeypatch.setattr(fake, "T_POSE_S", T_POSE_S)
    monkeypatch.setattr(stream, "perf_counter", clock.now_s)
    monkeypatch.setattr(reading_thread, "perf_counter", clock.now_s)
    save_stations(tmp_path / "stations.json", stations, {})
    scripts = [
        scripted_device(model, reports_of(stations, model, worn(k), SECONDS, seed=k), 2 + k)
        for k, model in enumerate(DEVICES)
    ]
    bench = Bench(scripts, clock, lambda usb: LighthouseDriver(tmp_path / "stations.json", usb))
    options = LiveOptions(duration_s=SECONDS, predictor="standing", quiet=True)
    told: list[str] = []
    with LiveSession(bench.driver, options, told.append, clock) as live:
        live.outputs.append(watching := Watching())  # type: ignore[arg-type]
        monkeypatch.setattr(live.source, "poll", bench.poll)
        live.run(lambda: False)
    assert not told
    assert live.session.calibrated
    roles = {serial: str(role) for serial, role in live.session.roles.items()}
    assert roles == {m.serial: str(role) for m, role in zip(DEVICES, FOUR_POINTS, strict=True)}
    summary = live.summary()
    assert summary.nonfinite_frames == 0
    assert set(summary.gate_events) <= {"untracked"}
    assert summary.tracker_loss[TrackerRole.HEAD] < 0.3, "only before light was seen"
    late = [pose for pose in watching.poses if pose.time_s > T_POSE_S]
    assert all((p.source[0, [Joint.HEAD, Joint.HIPS]] == Source.TRACKED).all() for p in late)
    for pose in late:
        true, _ = fake._joints(np.array([pose.time_s]), BODY)
        off = np.linalg.norm(pose.p_world[0] - true[0], axis=-1)
        assert off[[Joint.HIPS, Joint.HEAD]].max() < 0.05
        assert off[[Joint.LEFT_HAND, Joint.RIGHT_HAND]].max() < 0.10
