"""lobstr-train: from clips to weights."""

import json
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from support.motions import walking

from lobstr_hw.bvh_writer import write_bvh
from lobstr_hw.predictors import load_predictor
from lobstr_hw.runtime.commands.train import main
from lobstr_hw.splits import PARTS

CURE = "pip install torch==2.13.0 'lobstr-hw[train]'"


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A set of made walks and a split of it."""
    root = tmp_path_factory.mktemp("data")
    (root / "made" / "clips").mkdir(parents=True)
    for seed in range(3):
        walk = walking(6.0, seed=seed)
        path = root / "made" / "clips" / f"walk_{seed}.bvh"
        write_bvh(path, walk.p_hips, walk.R_local, walk.rate_hz)
    parts: dict[str, list[str]] = {part: [] for part in PARTS}
    split = {**parts, "train": ["made/walk_0", "made/walk_1"], "validation": ["made/walk_2"]}
    (root / "split.json").write_text(json.dumps(split), encoding="utf-8")
    config = {"steps": 4, "batch": 8, "hidden_size": 16, "validation_windows": 8}
    (root / "config.json").write_text(json.dumps(config), encoding="utf-8")
    return root


def arguments(data: Path, out: Path) -> list[str]:
    split, config = str(data / "split.json"), str(data / "config.json")
    return [str(data), "--split", split, "--config", config, "--out", str(out)]


@pytest.mark.torch
def test_a_run_trains_resumes_and_exports(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in ("torch", "onnx", "tqdm", "matplotlib"):
        pytest.importorskip(module, reason=CURE)
    run = tmp_path / "run"
    assert main(arguments(data, run)) == 0
    assert len((run / "curve.csv").read_text(encoding="utf-8").splitlines()) == 1 + 4
    assert (run / "curve.png").stat().st_size > 1000
    assert main([str(data), "--split", str(data / "split.json"), "--out", str(run)]) == 1
    assert "--resume" in capsys.readouterr().err
    more = [str(data), "--split", str(data / "split.json"), "--out", str(run)]
    assert main([*more, "--resume", "--steps", "6"]) == 0
    assert len((run / "curve.csv").read_text(encoding="utf-8").splitlines()) == 1 + 6
    assert main(["--export", str(run), str(tmp_path / "net.onnx")]) == 0
    details = load_predictor(str(tmp_path / "net.onnx")).card.details
    assert details["steps_done"] == details["steps_planned"] == 6
    assert details["data"]["clips"] == 2
    assert details["data"]["minutes_by_set"] == {"made": 0.2}


@pytest.mark.torch
def test_a_cosine_is_not_stretched_in_the_middle_of_a_run(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in ("torch", "tqdm", "matplotlib"):
        pytest.importorskip(module, reason=CURE)
    from lobstr_hw.training.config import read_config, write_config

    run = tmp_path / "run"
    assert main(arguments(data, run)) == 0
    config = read_config(run / "config.json", schedule="cosine")
    write_config(run / "config.json", config)
    more = [str(data), "--split", str(data / "split.json"), "--out", str(run), "--resume"]
    assert main([*more, "--steps", str(config.steps + 2)]) == 1
    assert f"for {config.steps} steps" in capsys.readouterr().err


@pytest.mark.torch
def test_clips_that_no_split_names_are_told(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("torch", reason=CURE)
    assert main([str(data), "--out", str(tmp_path / "run")]) == 1
    assert "FOLDER/clips/NAME.bvh" in capsys.readouterr().err


def test_without_torch_it_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.setitem(sys.modules, "onnx", None)
    assert main(["somewhere", "--out", str(tmp_path)]) == 1
    assert CURE in capsys.readouterr().err


@pytest.mark.parametrize(
    "options", [[], ["data"], ["data", "--export", "run", "out.onnx"], ["data", "--steps", "x"]]
)
def test_wrong_use_of_train_ends_with_two(options: list[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(options)
    assert end.value.code == 2


def test_help_of_train_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    assert "lobstr-train DATA --out" in capsys.readouterr().out


@pytest.mark.torch
def test_a_stopped_run_keeps_its_last_step(
    data: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("torch", reason=CURE)
    from lobstr_hw.training import loop

    step = loop.train_step

    def stopping(*arguments: Any) -> list[float]:
        if arguments[0].step == 1:
            signal.raise_signal(signal.SIGTERM)
        return step(*arguments)

    monkeypatch.setattr(loop, "train_step", stopping)
    assert main(arguments(data, tmp_path / "run")) == 0
    assert "stopped after step 2; go on with --resume" in capsys.readouterr().err
    rows = (tmp_path / "run" / "curve.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + 2
