"""lobstr-evaluate: one JSON document on stdout, all else on stderr."""

import json
import signal
from pathlib import Path

import pytest
from support.motions import walking

from lobstr_hw.bvh_writer import write_bvh
from lobstr_hw.runtime.commands.evaluate import main
from lobstr_hw.splits import PARTS

KEYS = {
    "frames",
    "contact_accuracy",
    "contact_balanced_accuracy",
    "contact_accuracy_1cm",
    "rotation_error_deg",
    "rotation_error_legs_deg",
    "position_error_cm",
    "skate_cm_s",
    "truth_skate_cm_s",
    "velocity_error_cm_s",
    "jitter_ratio",
}


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sets of made walks, as BVH in centimetres."""
    root = tmp_path_factory.mktemp("data")
    for folder, seeds in (("first", (0, 1)), ("second", (2,))):
        (root / folder / "clips").mkdir(parents=True)
        for seed in seeds:
            walk = walking(3.0, seed=seed)
            path = root / folder / "clips" / f"walk_{seed}.bvh"
            write_bvh(path, walk.p_hips, walk.R_local, walk.rate_hz)
    return root


def test_it_prints_one_document_with_all_folders_and_clips(
    data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(data), "--scale", "0.01"]) == 0
    tree = json.loads(capsys.readouterr().out)
    assert set(tree) == {"all", "folders", "clips"}
    assert set(tree["folders"]) == {"first", "second"}
    assert set(tree["clips"]) == {"first/walk_0", "first/walk_1", "second/walk_2"}
    for pair in (tree["all"], *tree["folders"].values(), *tree["clips"].values()):
        assert set(pair) == {"network", "after_ik"}
        assert all(set(scores) >= KEYS for scores in pair.values())
    assert tree["all"]["network"]["frames"] == 3 * (3 * 45 + 1 - 45)


def test_windowed_and_trivial_predictors_are_scored_too(
    data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = str(data / "second" / "clips" / "walk_2.bvh")
    scores = []
    for options in (["--mode", "windowed"], [], ["--predictor", "standing"]):
        assert main([clip, *options]) == 0
        scores.append(json.loads(capsys.readouterr().out)["all"]["network"])
    assert scores[0]["frames"] == scores[1]["frames"] == scores[2]["frames"]
    assert len({s["position_error_cm"] for s in scores}) == 3


def test_a_table_has_the_trivial_rows_and_json_stays_alone_on_stdout(
    data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = str(data / "second" / "clips" / "walk_2.bvh")
    assert main([clip, "--table"]) == 0
    table = capsys.readouterr().out
    for row in ("lobstr, carried, network", "standing, after IK", "mean_pose, network"):
        assert f"| {row} |" in table
    assert main([clip, "--table", "--json"]) == 0
    printed = capsys.readouterr()
    assert "all" in json.loads(printed.out)
    assert "mean_pose" in printed.err


def test_a_part_of_a_split_is_scored_alone(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    split = tmp_path / "split.json"
    parts = {part: ["first/walk_1"] if part == "test" else [] for part in PARTS}
    split.write_text(json.dumps(parts), encoding="utf-8")
    assert main([str(data), "--split", str(split), "--part", "test"]) == 0
    assert set(json.loads(capsys.readouterr().out)["clips"]) == {"first/walk_1"}
    assert main([str(data), "--split", str(split), "--part", "train"]) == 1
    assert "no clip of the part 'train'" in capsys.readouterr().err
    assert main([str(data), "--split", str(split)]) == 1
    assert "--part" in capsys.readouterr().err


def test_a_row_of_the_manifest_without_its_file_is_noted(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clips = tmp_path / "set" / "clips"
    clips.mkdir(parents=True)
    source = data / "second" / "clips" / "walk_2.bvh"
    (clips / "here.bvh").write_bytes(source.read_bytes())
    manifest = "file,subject,metres_per_unit\nclips/here.bvh,Ann,0.01\nclips/gone.bvh,Ann,0.01\n"
    (tmp_path / "set" / "manifest.csv").write_text(manifest, encoding="utf-8")
    assert main([str(tmp_path / "set")]) == 0
    printed = capsys.readouterr()
    assert set(json.loads(printed.out)["clips"]) == {"set/here"}
    assert "1 rows without their file, the first clips/gone.bvh" in printed.err


def test_pictures_are_written(data: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="pip install 'lobstr-hw[plots]'")
    assert main([str(data / "second"), "--plots", str(tmp_path / "plots")]) == 0
    for name in ("position_error_cm", "error_over_time", "contacts", "legs"):
        assert (tmp_path / "plots" / f"{name}.png").stat().st_size > 1000


def test_a_missing_path_and_an_unknown_predictor_fail_with_one_message(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path / "none")]) == 1
    assert "no such file" in capsys.readouterr().err
    assert main([str(data), "--predictor", "lobster"]) == 1
    printed = capsys.readouterr()
    assert "lobstr, lobstr-paper, mean_pose, standing" in printed.err
    assert printed.out == ""


@pytest.mark.parametrize("options", [[], ["x", "--trackers", "6"], ["x", "--scale", "0"]])
def test_wrong_use_ends_with_two(options: list[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(options)
    assert end.value.code == 2


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    assert "lobstr-evaluate DATA" in capsys.readouterr().out


def test_it_ends_cleanly_when_asked_to(
    data: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from lobstr_hw.runtime.commands import evaluate

    def stopping(done: int, count: int, name: str) -> None:
        signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(evaluate, "_progress_retargeting", stopping)
    assert main([str(data)]) == 0
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "stopped" in printed.err
