"""Clips on disk, their manifest, and what their faults take away."""

from pathlib import Path

import numpy as np
import pytest

from lobstr_hw.errors import FileFormatError
from lobstr_hw.retargeting import Fault, find_clips, own_faults, read_faults
from lobstr_hw.retargeting.cuts import bad_frames, find_flips, find_jumps, good_pieces
from lobstr_hw.rotations import rotation_x, rotation_y
from lobstr_hw.skeleton import Joint


def touch(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("HIERARCHY", encoding="utf-8")
    return path


def test_clips_are_found_below_a_folder_and_named_by_it(tmp_path: Path) -> None:
    touch(tmp_path / "walks" / "clips" / "b.bvh")
    touch(tmp_path / "walks" / "clips" / "a.bvh")
    touch(tmp_path / "loose" / "c.bvh")
    clips = find_clips([tmp_path / "walks", tmp_path / "loose" / "c.bvh"])
    assert [c.name for c in clips] == ["walks/a", "walks/b", "loose/c"]
    assert [c.subject for c in clips] == ["walks", "walks", "loose"]
    assert {c.metres_per_unit for c in clips} == {None}


def test_a_manifest_above_the_clips_adds_what_it_knows(tmp_path: Path) -> None:
    touch(tmp_path / "set" / "clips" / "a.bvh")
    touch(tmp_path / "set" / "clips" / "s_003_1_2.bvh")
    (tmp_path / "set" / "manifest.csv").write_text(
        "file,category,subject,seconds,metres_per_unit\n"
        'clips/a.bvh,walk,"Ann, the first",3.5,0.0254\n'
        "clips/s_003_1_2.bvh,sport,session s_003,9,0.01\n"
        "clips/gone.bvh,walk,Ann,1,0.01\n",
        encoding="utf-8",
    )
    first, second = find_clips([tmp_path])
    assert (first.subject, first.category, first.seconds) == ("Ann, the first", "walk", 3.5)
    assert first.metres_per_unit == 0.0254
    assert second.subject == "session s_003 player 2"


def test_a_scale_that_is_given_overrules_the_manifest(tmp_path: Path) -> None:
    touch(tmp_path / "a.bvh")
    (tmp_path / "manifest.csv").write_text("file,metres_per_unit\na.bvh,0.01\n", encoding="utf-8")
    assert find_clips([tmp_path], 0.5)[0].metres_per_unit == 0.5


@pytest.mark.parametrize("what", ["nowhere", "empty"])
def test_a_path_without_clips_is_told(tmp_path: Path, what: str) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileFormatError, match=what):
        find_clips([tmp_path / what])


def test_frames_of_a_fault_may_be_stretches_single_or_open(tmp_path: Path) -> None:
    path = tmp_path / "faults.csv"
    path.write_text(
        "set,clip,action,frames,why\n"
        'a,b,cut,"245, 349-354, 876-","it, jumps"\n'
        "a,c,leave_out,,flipped\n",
        encoding="utf-8",
    )
    cut, out = read_faults(path)
    assert cut == Fault("a", "b", "cut", ((245, 245), (349, 354), (876, None)), "it, jumps")
    assert out == Fault("a", "c", "leave_out", (), "flipped")


def test_the_own_list_knows_three_actions_and_no_clip_twice_alike() -> None:
    faults = own_faults()
    assert {f.action for f in faults} == {"leave_out", "cut", "care"}
    rows = [(f.set_name, f.clip, f.action, f.frames) for f in faults if f.action != "care"]
    assert len(rows) == len(set(rows))


def still(frames: int = 200) -> np.ndarray:
    return np.tile(np.eye(3), (frames, 22, 1, 1))


def test_named_frames_are_cut_and_short_rests_dropped() -> None:
    faults = [Fault("a", "b", "cut", ((40, 60), (75, 75), (180, None)), "")]
    bad = bad_frames(still(), 30.0, faults)
    # 61 to 74 is under a second
    assert good_pieces(bad, 30.0) == [(0, 40), (76, 180)]


def test_a_clip_without_faults_is_one_piece() -> None:
    assert good_pieces(bad_frames(still(), 30.0, []), 30.0) == [(0, 200)]


def test_a_jump_is_found_where_it_is_and_a_short_flip_with_all_between() -> None:
    R = still()
    R[100:110, Joint.LEFT_HAND] = rotation_x(2.0)
    bad = find_jumps(R, 30.0)
    assert bad[100:110].all()
    assert not bad[:97].any()
    assert not bad[114:].any()


def test_a_fast_turn_is_no_jump() -> None:
    R = still()
    R[:, Joint.HIPS] = rotation_y(np.radians(50.0) * np.arange(200))
    assert not find_jumps(R, 30.0).any()


def test_a_head_that_stays_flipped_is_bad_to_its_end() -> None:
    R = still()
    R[50:, Joint.HEAD] = rotation_y(np.pi * 0.9)
    assert find_flips(R)[50:].all()
    assert not find_flips(R)[:50].any()


def test_looking_over_the_shoulder_and_bowing_are_no_flips() -> None:
    R = still()
    R[:, Joint.HEAD] = rotation_y(np.radians(80.0))
    R[:, Joint.SPINE] = rotation_x(np.radians(80.0))
    assert not find_flips(R).any()
