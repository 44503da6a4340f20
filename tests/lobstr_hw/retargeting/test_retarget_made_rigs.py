"""A walk put on rigs of any frames, names, sizes and rates comes back as the walk that it was."""

from pathlib import Path

import numpy as np
import pytest
from support.gaits import planted_walk, write_rig

from lobstr_hw.bvh import write_bvh
from lobstr_hw.motion import Motion
from lobstr_hw.retargeting import Fault, Note, find_clips, retarget
from lobstr_hw.retargeting.agreement import measure
from lobstr_hw.rotations import geodesic_angle, heading, rotation_x
from lobstr_hw.skeleton import STANDARD_OFFSETS, Joint

LEGS = [j for j in Joint if j >= Joint.LEFT_UPPER_LEG]
WALK = planted_walk()


def back(folder: Path) -> Motion:
    (motion,) = retarget(find_clips([folder]))
    return motion


@pytest.mark.parametrize("seed", range(4))
def test_joint_frames_of_any_kind_give_the_same_body(tmp_path: Path, seed: int) -> None:
    write_rig(tmp_path / "a.bvh", WALK, seed)
    motion = back(tmp_path)
    p, _ = motion.joints()
    truth, _ = WALK.joints()
    off = np.linalg.norm(p - truth, axis=-1)
    assert np.median(off[:, LEGS]) < 0.003
    assert np.percentile(off[:, LEGS], 95) < 0.015
    assert np.median(off) < 0.01
    angles = np.degrees(geodesic_angle(motion.R_local, WALK.R_local))
    assert np.median(angles[:, LEGS], axis=0).max() < 1.5
    assert np.median(angles, axis=0).max() < 4.0


def test_toe_bases_are_met_to_a_tenth_of_a_millimetre(tmp_path: Path) -> None:
    write_rig(tmp_path / "a.bvh", WALK, 9)
    motion = back(tmp_path)
    p, _ = motion.joints()
    off = np.linalg.norm(p[:, [Joint.LEFT_TOES, Joint.RIGHT_TOES]] - motion.p_toes, axis=-1)
    assert off.max() < 1e-4


def test_size_and_unit_of_the_rig_do_not_matter_but_are_told(tmp_path: Path) -> None:
    for name, size in (("small", 0.8), ("tall", 1.1)):
        write_rig(tmp_path / name / "a.bvh", WALK, 1, size=size)
    small, tall = back(tmp_path / "small"), back(tmp_path / "tall")
    assert np.abs(small.joints()[0] - tall.joints()[0]).max() < 1e-4
    assert small.metres == pytest.approx(0.8, rel=1e-3)
    assert tall.metres == pytest.approx(1.1, rel=1e-3)


def test_a_clip_of_120_frames_a_second_gives_the_same_45(tmp_path: Path) -> None:
    write_rig(tmp_path / "slow" / "a.bvh", WALK, 2)
    write_rig(tmp_path / "fast" / "a.bvh", planted_walk(rate_hz=120.0), 2)
    slow, fast = back(tmp_path / "slow"), back(tmp_path / "fast")
    assert slow.rate_hz == fast.rate_hz == 45.0
    assert len(slow) == len(fast)
    off = np.linalg.norm(slow.joints()[0] - fast.joints()[0], axis=-1)
    assert np.percentile(off, 99) < 0.002


def test_a_floor_that_is_high_and_slopes_by_a_degree_is_levelled(tmp_path: Path) -> None:
    tilt = rotation_x(np.radians(1.0))
    R = np.array(WALK.R_local)
    R[:, 0] = tilt @ R[:, 0]
    sloping = Motion("a/b", "c", 45.0, WALK.p_hips @ tilt.T + [0, 0.3, 0], R, WALK.p_toes, 1.0)
    write_rig(tmp_path / "a.bvh", sloping, 3)
    motion = back(tmp_path)
    still = np.linalg.norm(np.diff(motion.p_toes, axis=0), axis=-1) < 0.001
    heights = motion.p_toes[1:, :, 1][still]
    assert np.abs(heights - 0.020).max() < 0.004
    assert np.ptp(motion.p_hips[:, 1]) < 0.04


def test_knees_are_hinges_that_bend_backward_only(tmp_path: Path) -> None:
    write_rig(tmp_path / "a.bvh", WALK, 4)
    knees = back(tmp_path).R_local[:, [Joint.LEFT_LOWER_LEG, Joint.RIGHT_LOWER_LEG]]
    assert np.abs(knees[..., 0, 0] - 1.0).max() < 1e-9
    assert knees[..., 2, 1].min() > -1e-9


def test_a_file_of_our_own_skeleton_comes_back_as_it_was(tmp_path: Path) -> None:
    write_bvh(tmp_path / "own.bvh", 1.3 * WALK.p_hips, WALK.R_local, 45.0, 1.3 * STANDARD_OFFSETS)
    motion = back(tmp_path)
    assert np.abs(motion.joints()[0] - WALK.joints()[0]).max() < 1e-4
    assert np.degrees(geodesic_angle(motion.R_local, WALK.R_local)).max() < 0.1
    assert motion.metres == pytest.approx(1.3, rel=1e-4)


def test_the_walk_is_measured_as_it_was_made(tmp_path: Path) -> None:
    write_rig(tmp_path / "one" / "a.bvh", WALK, 5)
    write_rig(tmp_path / "two" / "a.bvh", WALK, 6)
    clips = find_clips([tmp_path])
    gaits = measure([*retarget(clips), WALK])
    made = gaits.pop("made")
    for gait in gaits.values():
        assert gait.thigh_pitch == pytest.approx(made.thigh_pitch, abs=0.5)
        assert gait.knee_flexion == pytest.approx(made.knee_flexion, abs=1.0)
        assert gait.foot_heading == pytest.approx(made.foot_heading, abs=1.0)
        assert gait.stance_toe == pytest.approx(2.0, abs=0.2)
        assert gait.toe_error_mm < 0.1


def test_a_cut_clip_comes_in_pieces_and_one_left_out_not_at_all(tmp_path: Path) -> None:
    for name in "abc":
        write_rig(tmp_path / f"{name}.bvh", WALK, 7)
    folder = tmp_path.name
    faults = [
        Fault(folder, "a", "cut", ((100, 120),), "a bad stretch"),
        Fault(folder, "b", "leave_out", (), "all of it"),
    ]
    notes: list[Note] = []
    done: list[tuple[int, int, str]] = []
    motions = list(
        retarget(
            find_clips([tmp_path]), faults, lambda *step: done.append(step), notes=notes.append
        )
    )
    assert [m.name for m in motions] == [f"{folder}/a#0", f"{folder}/a#1", f"{folder}/c"]
    assert len(motions[0]) == 100
    whole = motions[2]
    assert np.abs(motions[1].p_hips - whole.p_hips[121:]).max() < 1e-7
    assert [n.text for n in notes if n.clip.endswith("/b")] == ["left out: all of it"]
    assert done[-1][:2] == (3, 3)


def test_a_standing_clip_says_what_it_shows_too_little_of(tmp_path: Path) -> None:
    stand, p_hips = np.tile(np.eye(3), (90, 22, 1, 1)), np.tile([0.0, 1.0, 0.0], (90, 1))
    standing = Motion("a/b", "c", 45.0, p_hips, stand, np.zeros((90, 2, 3)), 1.0)
    write_rig(tmp_path / "a.bvh", standing, 8)
    notes: list[Note] = []
    (motion,) = retarget(find_clips([tmp_path]), notes=notes.append)
    assert any("walking upright" in n.text for n in notes)
    assert any("knee" in n.text for n in notes)
    facing = heading(motion.R_local[:, Joint.HIPS])
    assert np.degrees(geodesic_angle(facing, np.eye(3))).max() < 1.0
    assert np.abs(motion.p_toes[..., 1] - 0.020).max() < 1e-3
