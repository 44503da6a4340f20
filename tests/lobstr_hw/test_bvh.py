"""BVH files: what is written is read back; what is broken is told with its line."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lobstr_hw.bvh import Bvh, hierarchy, motion_line, read_bvh, read_skeleton, write_bvh
from lobstr_hw.bvh_writer import FRAMES_WIDTH, motion_head
from lobstr_hw.errors import MotionFileError
from lobstr_hw.rotations import Array, from_rotation_vector, geodesic_angle
from lobstr_hw.skeleton import HUMANOID_NAMES, PARENTS, STANDARD_OFFSETS, forward_kinematics

ODD = """HIERARCHY\r
ROOT  Hips\r
{\r
\tOFFSET 1.0\t90.0 2.0\r
\tCHANNELS 6 Yrotation Xposition Zrotation Yposition Xrotation Zposition\r
\tJOINT Spine {\r
\t\tOFFSET 0 10 0\r
\t\tCHANNELS 4 Yposition Yrotation Xrotation Zrotation\r
\t\tEnd Site\r
\t\t{\r
\t\t\tOFFSET 0 5 0\r
\t\t}\r
\t}\r
}\r
MOTION\r
Frames:     5   \r
Frame Time: 0.04\r
10 1 20 91 30 3  11 40 50 60\r
-10\t1.5\t-20\t92\t-30\t3.5\t12\t-40\t-50\t-60\r
"""


def random_clip(seed: int, frames: int = 7) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.normal(0.0, 2.0, (frames, 3)), from_rotation_vector(
        rng.normal(0.0, 1.5, (frames, 22, 3))
    )


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8", newline="")
    return path


@pytest.mark.parametrize("seed", range(3))
def test_what_is_written_is_read_back(tmp_path: Path, seed: int) -> None:
    p, R = random_clip(seed)
    write_bvh(tmp_path / "a.bvh", p, R, 45.0)
    bvh = read_bvh(tmp_path / "a.bvh")
    assert bvh.names == HUMANOID_NAMES
    assert bvh.parents == PARENTS
    assert bvh.frame_time_s == pytest.approx(1.0 / 45.0, abs=1e-9)
    assert geodesic_angle(bvh.R_local, R).max() < 1e-6
    assert np.abs(bvh.p_local[:, 0] / 100.0 - p).max() < 1e-6
    joints = bvh.world()[0] / 100.0
    assert np.abs(joints - forward_kinematics(R, p)[0]).max() < 1e-6


def test_bones_of_a_written_file_keep_their_length(tmp_path: Path) -> None:
    p, R = random_clip(3, frames=50)
    write_bvh(tmp_path / "a.bvh", p, R, 45.0)
    joints = read_bvh(tmp_path / "a.bvh").world()[0] / 100.0
    bones = np.linalg.norm(joints[:, 1:] - joints[:, PARENTS[1:]], axis=-1)
    assert np.abs(bones - np.linalg.norm(STANDARD_OFFSETS[1:], axis=-1)).max() < 1e-6


def test_the_angles_in_the_file_are_what_another_program_takes_them_for(tmp_path: Path) -> None:
    p, R = random_clip(4, frames=1)
    write_bvh(tmp_path / "a.bvh", p, R, 45.0)
    numbers = np.array((tmp_path / "a.bvh").read_text().splitlines()[-1].split(), dtype=float)
    angles = numbers[3:].reshape(22, 3)
    by_scipy = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
    assert np.abs(by_scipy - R[0]).max() < 1e-6
    assert np.abs(numbers[:3] - 100.0 * p[0]).max() < 1e-6


def test_a_recording_can_write_the_frame_count_over_the_old_one(tmp_path: Path) -> None:
    p, R = random_clip(5, frames=3)
    path = tmp_path / "live.bvh"
    with path.open("w+", encoding="utf-8", newline="\n") as file:
        file.write(hierarchy())
        place = file.tell() + len("MOTION\nFrames: ")
        file.write(motion_head(0, 1.0 / 45.0))
        for k in range(3):
            file.write(motion_line(100.0 * p[k], R[k]))
        file.seek(place)
        file.write(f"{3:<{FRAMES_WIDTH}d}")
    bvh = read_bvh(path)
    assert len(bvh) == 3
    assert geodesic_angle(bvh.R_local, R).max() < 1e-6


def odd(tmp_path: Path) -> Bvh:
    return read_bvh(write(tmp_path / "odd.bvh", ODD))


def test_channels_may_come_in_any_order(tmp_path: Path) -> None:
    bvh = odd(tmp_path)
    turns = Rotation.from_euler("YZX", [[10, 20, 30], [-10, -20, -30]], degrees=True)
    assert np.allclose(bvh.R_local[:, 0], turns.as_matrix())
    assert np.allclose(bvh.p_local[:, 0], np.array([[1.0, 91.0, 3.0], [1.5, 92.0, 3.5]]))


def test_a_joint_may_move_and_a_channel_replaces_only_its_own_coordinate(tmp_path: Path) -> None:
    assert np.allclose(odd(tmp_path).p_local[:, 1], [[0, 11, 0], [0, 12, 0]])


def test_fewer_lines_than_frames_says_are_taken_as_they_are(tmp_path: Path) -> None:
    assert len(odd(tmp_path)) == 2


def test_a_joint_may_be_called_motion(tmp_path: Path) -> None:
    path = write(tmp_path / "named.bvh", ODD.replace("Spine", "MOTION_Spine"))
    assert read_bvh(path).names == ("Hips", "MOTION_Spine")
    assert len(read_bvh(path)) == 2


def test_a_last_line_that_breaks_off_is_left_out(tmp_path: Path) -> None:
    path = write(tmp_path / "cut.bvh", ODD.replace(" -60\r\n", "").replace("\t-60\r\n", ""))
    assert len(read_bvh(path)) == 1


def test_the_skeleton_alone_is_read_without_the_motion(tmp_path: Path) -> None:
    path = write(tmp_path / "odd.bvh", ODD)
    names, offsets = read_skeleton(path)
    assert names == ("Hips", "Spine")
    # offsets that channels replace say nothing about the rig
    assert np.array_equal(offsets, np.zeros((2, 3)))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("11 40 50 60", "11 40 nan 60", "line 18.*'nan'"),
        ("-10\t1.5", "-10\toops", "line 19.*'oops'"),
        ("Frames:     5", "Frames: many", "line 16.*many"),
        ("Frame Time: 0.04", "Frame Time: 0", "line 16.*0.0 s"),
        ("OFFSET 0 10 0", "OFFSET 0 10", "line 7.*three numbers"),
        ("CHANNELS 4 Yposition", "CHANNELS 4 Wposition", "line 8.*Wposition"),
        ("JOINT Spine {", "JOINED Spine {", "line 6.*JOINED"),
        ("MOTION", "NOTION", "without a MOTION"),
        ("\t}\r\n}\r\n", "\t}\r\n", "1 brace"),
    ],
)
def test_a_broken_file_is_told_with_its_line(tmp_path: Path, old: str, new: str, told: str) -> None:
    assert old in ODD
    path = write(tmp_path / "broken.bvh", ODD.replace(old, new))
    with pytest.raises(MotionFileError, match=told) as error:
        read_bvh(path)
    assert "broken.bvh" in str(error.value)


def test_a_file_without_a_whole_frame_is_told(tmp_path: Path) -> None:
    path = write(tmp_path / "empty.bvh", ODD.split("10 1 20")[0] + "10 1 20\r\n")
    with pytest.raises(MotionFileError, match=r"line 18.*no frame of 10 numbers"):
        read_bvh(path)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(MotionFileError, match=r"nowhere\.bvh"):
        read_bvh(tmp_path / "nowhere.bvh")
