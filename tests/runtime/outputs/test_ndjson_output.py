import json
from pathlib import Path

import numpy as np
import pytest
from support.poses import random_poses

from lobstr_hw.errors import OutputError
from lobstr_hw.rotations import from_quat_xyzw, geodesic_angle
from lobstr_hw.runtime.outputs.ndjson import NdjsonOutput
from lobstr_hw.skeleton import HUMANOID_NAMES, Body, global_rotations

BODY = Body.standard()


def test_each_line_is_one_frame_in_world_space(tmp_path: Path) -> None:
    path = tmp_path / "out.ndjson"
    output = NdjsonOutput(str(path))
    output.open(BODY, 45.0, "take")
    poses = random_poses(1, 20, BODY)
    for pose in poses:
        output.send(pose, ())
    output.close()
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    assert len(rows) == 20
    for frame, (row, pose) in enumerate(zip(rows, poses, strict=True)):
        assert list(row) == ["time_s", "frame", "joints", "contact", "roles"]
        assert tuple(row["joints"]) == HUMANOID_NAMES
        joints = np.array(list(row["joints"].values()))
        np.testing.assert_allclose(joints[:, :3], pose.p_world[0], atol=1e-7)
        R = from_quat_xyzw(joints[:, 3:])
        assert geodesic_angle(R, global_rotations(pose.R_local[0])).max() < 1e-6
        assert row["frame"] == frame
        assert row["time_s"] == pytest.approx(frame / 45.0, abs=1e-6)
        assert row["contact"] == pose.contact[0].tolist()
        assert row["roles"] == {role.value: "ok" for role in pose.roles}


def test_a_missing_folder_is_told_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="make it first"):
        NdjsonOutput(str(tmp_path / "no" / "out")).open(BODY, 45.0, "take")
