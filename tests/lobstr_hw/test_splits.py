"""The split that comes with the project, and reading of others."""

import csv
import json
from pathlib import Path

import pytest

from lobstr_hw.errors import FileFormatError
from lobstr_hw.splits import PARTS, clip_name, default_split, read_split

DATA = Path(__file__).parents[3] / "shared" / "data"


def subjects() -> dict[str, str]:
    """Clip -> person, from the manifests; a basketball session counts as its people."""
    if not DATA.is_dir():
        pytest.skip(f"no motion data at {DATA}")
    out = {}
    for manifest in DATA.glob("*/manifest.csv"):
        with manifest.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                clip = f"{manifest.parent.name}/{Path(row.get('file') or '').stem}"
                out[clip] = row.get("subject", "")
    return out


def test_no_clip_is_in_two_parts() -> None:
    parts = default_split().parts
    for i, part in enumerate(PARTS):
        assert parts[part], part
        for other in PARTS[i + 1 :]:
            assert not parts[part] & parts[other]


def test_nobody_who_is_tested_is_trained_on_and_validation_is_apart_from_both() -> None:
    person, parts = subjects(), default_split().parts
    people = {part: {person[clip] for clip in parts[part]} for part in PARTS}
    assert not people["train"] & people["test"]
    assert not people["validation"] & (people["train"] | people["test"])
    assert people["test_same_actor"] <= people["train"]


def test_every_name_is_a_clip_that_is_not_left_out_as_faulty() -> None:
    person = subjects()
    with (DATA / "faults.csv").open(encoding="utf-8", newline="") as file:
        faulty = {
            f"{row['set']}/{row['clip']}"
            for row in csv.DictReader(file)
            if row["action"] == "leave_out"
        }
    for names in default_split().parts.values():
        assert names <= set(person)
        assert not names & faulty


def test_data_whose_licence_forbids_it_is_in_no_part_that_shapes_weights() -> None:
    split = default_split()
    for part in ("train", "validation"):
        folders = {name.split("/")[0] for name in split.parts[part]}
        assert not {f for f in folders if f.startswith(("bandai_namco", "deepmimic"))}


def test_the_chair_takes_are_held_out() -> None:
    split = default_split()
    assert split.part_of("snu_tiling_patch/1_chair") == "test_same_actor"
    assert split.part_of("snu_tiling_patch/1_chair_1#0") == "test_same_actor"
    assert split.part_of("elsewhere/clip") is None


def test_a_piece_and_a_mirror_image_belong_to_their_clip() -> None:
    assert clip_name("set/clip#2~mirrored") == "set/clip"
    assert clip_name("set/clip~mirrored") == "set/clip"


def test_a_clip_in_two_parts_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "split.json"
    lists = {part: ["a/b"] if part in PARTS[:2] else [] for part in PARTS}
    path.write_text(json.dumps(lists), encoding="utf-8")
    with pytest.raises(FileFormatError, match="more than one part: a/b"):
        read_split(path)


def test_what_is_no_split_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "split.json"
    path.write_text('{"train": []}', encoding="utf-8")
    with pytest.raises(FileFormatError, match="validation"):
        read_split(path)
    with pytest.raises(FileFormatError, match="cannot be read"):
        read_split(tmp_path / "none.json")
