from pathlib import Path

import numpy as np
import pytest
from support.poses import random_poses

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.tracker_log import read_log
from lobstr_hw.errors import OutputError
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import rotation_y
from lobstr_hw.runtime.outputs.mcap import McapOutput
from lobstr_hw.skeleton import Body
from lobstr_hw.trackers import FOUR_POINTS, TrackerSample, TrackingState

BODY = Body.standard()
ROLES = {f"LHR-{i}": role for i, role in enumerate(FOUR_POINTS)}


def samples(time_s: float) -> list[TrackerSample]:
    return [
        TrackerSample(
            serial, PartialPose(rotation_y(time_s), np.array([time_s, i, 0])), time_s, True
        )
        for i, serial in enumerate(ROLES)
    ]


def write(path: Path) -> None:
    output = McapOutput(path, ROLES.get)
    output.open(BODY, 45.0, "monday")
    for pose in random_poses(1, 30, BODY):
        given = samples(pose.time_s)
        if pose.time_s > 3.3:
            given[3] = TrackerSample(
                "LHR-3", given[3].T_world_tracker, pose.time_s, False, TrackingState.OCCLUDED
            )
        output.send(pose, given)
    output.close()
    output.close()


def test_samples_roles_states_and_skeleton_are_read_back(tmp_path: Path) -> None:
    write(tmp_path / "out.mcap")
    log = read_log(tmp_path / "out.mcap")
    assert log.metadata["take"]["name"] == "monday"
    assert {track.serial: track.role for track in log.trackers} == ROLES
    assert all(len(track) == 30 for track in log.trackers)
    lost = log.tracker("LHR-3")
    assert lost.tracked.tolist() == [3.0 + k / 45.0 <= 3.3 for k in range(30)]
    assert log.skeleton is not None
    poses = random_poses(1, 30, BODY)
    np.testing.assert_allclose(
        log.skeleton.p_local[:, 0], [pose.p_world[0, 0] for pose in poses], atol=1e-6
    )


def test_what_happened_is_kept_too(tmp_path: Path) -> None:
    output = McapOutput(tmp_path / "out.mcap", ROLES.get)
    output.open(BODY, 45.0, "take")
    first, second = random_poses(1, 2, BODY)
    output.send(first, samples(first.time_s))
    pressed = DeviceEvent(EventKind.BUTTON_DOWN, "LHR-1", first.time_s + 0.01, "menu")
    output.events.append(pressed)
    output.send(second, samples(second.time_s))
    output.events.append(DeviceEvent(EventKind.RECENTRED, "", second.time_s))
    output.close()
    log = read_log(tmp_path / "out.mcap")
    held = [change.device.buttons for change in log.tracker("LHR-1").states]
    assert held == [(), ("menu",)]
    assert [event.kind for event in log.events] == [EventKind.RECENTRED]


def test_the_same_calls_give_the_same_bytes(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    write(tmp_path / "b.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_a_missing_folder_is_told_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="make this one first"):
        McapOutput(tmp_path / "no" / "out.mcap", ROLES.get).open(BODY, 45.0, "take")


@pytest.mark.parametrize("offset_s", [1.7e9, None])
def test_the_offset_to_unix_time_is_kept_where_it_is_known(
    tmp_path: Path, offset_s: float | None
) -> None:
    def offset(now_s: float) -> float | None:
        assert now_s == 3.0
        return offset_s

    output = McapOutput(tmp_path / "out.mcap", ROLES.get, offset)
    output.open(BODY, 45.0, "take")
    for pose in random_poses(1, 2, BODY):
        output.send(pose, samples(pose.time_s))
    output.close()
    assert read_log(tmp_path / "out.mcap").unix_offset_s == offset_s
