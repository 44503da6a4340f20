from pathlib import Path

import numpy as np
import pytest
from support.poses import random_poses

from lobstr_hw.bvh import read_bvh
from lobstr_hw.errors import OutputError
from lobstr_hw.runtime.outputs.bvh import BvhOutput
from lobstr_hw.skeleton import Body

STANDARD, USER = Body.standard(), Body.standard(hips_height_m=0.87)
RATE_HZ = 45.0


def opened(path: Path) -> BvhOutput:
    output = BvhOutput(path)
    output.open(STANDARD, RATE_HZ, "take")
    return output


def test_what_was_sent_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "out.bvh"
    output = opened(path)
    output.calibrated(USER)
    poses = random_poses(1, 100, USER)
    for pose in poses:
        output.send(pose, ())
    output.close()
    clip = read_bvh(path)
    p, _ = clip.world()
    assert clip.frame_time_s == pytest.approx(1 / RATE_HZ, abs=1e-9)
    np.testing.assert_allclose(p / 100, np.concatenate([x.p_world for x in poses]), atol=1e-7)


def test_frames_before_the_calibration_get_the_users_body_and_stand_on_its_floor(
    tmp_path: Path,
) -> None:
    path = tmp_path / "out.bvh"
    output = opened(path)
    early, later = random_poses(2, 10, STANDARD), random_poses(3, 10, USER)
    for pose in early:
        output.send(pose, ())
    output.calibrated(USER)
    for pose in later:
        output.send(pose, ())
    output.close()
    p, R = read_bvh(path).world()
    assert len(p) == 20
    heights = [0.87 * pose.p_world[0, 0, 1] for pose in early]
    np.testing.assert_allclose(p[:10, 0, 1] / 100, heights, atol=1e-7)
    np.testing.assert_allclose(R[:10, 0], [pose.R_local[0, 0] for pose in early], atol=1e-7)
    lengths = np.linalg.norm(p[:, 17] - p[:, 16], axis=-1)
    assert np.ptp(lengths) < 1e-5


def test_without_a_calibration_the_standard_body_is_written(tmp_path: Path) -> None:
    path = tmp_path / "out.bvh"
    output = opened(path)
    poses = random_poses(4, 3, STANDARD)
    for pose in poses:
        output.send(pose, ())
    output.close()
    output.close()
    p, _ = read_bvh(path).world()
    np.testing.assert_allclose(p / 100, np.concatenate([x.p_world for x in poses]), atol=1e-7)


def test_at_any_moment_the_file_on_disk_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "out.bvh"
    output = opened(path)
    output.calibrated(USER)
    for i, pose in enumerate(random_poses(5, 120, USER), start=1):
        output.send(pose, ())
        text = path.read_text(encoding="utf-8")
        count = int(text.split("Frames:")[1].split()[0])
        assert len(text.split("Frame Time:")[1].strip().splitlines()) - 1 == count
        assert i - count <= RATE_HZ / 2
    output.close()
    assert len(read_bvh(path)) == 120


def test_a_missing_folder_is_told_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="does not exist; make it first"):
        opened(tmp_path / "nowhere" / "out.bvh")
    with pytest.raises(OutputError, match="choose another file"):
        opened(tmp_path)
