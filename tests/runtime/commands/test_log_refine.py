"""``lobstr-log export --refine``, as its user types it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.made_logs import made_take, write_log

from lobstr_hw.bvh import read_bvh
from lobstr_hw.calibration import save_profile
from lobstr_hw.runtime.commands.live import main as lobstr_live
from lobstr_hw.runtime.commands.log import main as lobstr_log
from lobstr_hw.runtime.refining import seen_in


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A T-pose and a walk of three seconds."""
    return write_log(tmp_path_factory.mktemp("logs") / "walk.mcap", made_take(seconds=3.0))


@pytest.fixture(scope="module")
def refined(log: Path) -> Path:
    """Made by a process of its own."""
    out = log.with_name("refined.bvh")
    command = [sys.executable, "-m", "lobstr_hw.runtime.commands.log", "export", str(log)]
    done = subprocess.run(
        [*command, "--bvh", str(out), "--refine"], check=False, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "the legs refined" in done.stdout
    return out


def test_the_file_has_the_live_programs_frames_and_body(log: Path, refined: Path) -> None:
    live = log.with_name("live.bvh")
    assert lobstr_live(["--sim", str(log), "--fast", "--quiet", "--output", f"bvh:{live}"]) == 0
    ours, theirs = (read_bvh(path) for path in (refined, live))
    assert ours.names == theirs.names
    np.testing.assert_allclose(ours.offsets, theirs.offsets)
    assert len(ours.R_local) == len(theirs.R_local)
    differs = np.abs(ours.R_local - theirs.R_local).max(axis=(0, 2, 3)) > 1e-3
    moved = {name for name, other in zip(ours.names, differs, strict=True) if other}
    assert moved and all("Leg" in name or "Foot" in name or "Toes" in name for name in moved)


def test_the_same_log_gives_the_same_bytes(log: Path, refined: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.bvh"
    assert lobstr_log(["export", str(log), "--bvh", str(again), "--refine"]) == 0
    assert again.read_bytes() == refined.read_bytes()


def test_ndjson_and_the_report_agree_on_the_frames(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.ndjson"
    assert lobstr_log(["export", str(log), "--ndjson", str(out), "--refine", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["refined"] is True
    assert report["rows"] == len(out.read_text(encoding="utf-8").splitlines())


def test_a_cut_log_is_told(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cut, out = tmp_path / "cut.mcap", tmp_path / "out.ndjson"
    cut.write_bytes(log.read_bytes()[:-50])
    arguments = ["export", str(cut), "--ndjson", str(out), "--refine"]
    assert lobstr_log(arguments) == 0
    assert "the log is cut: the file ends in the middle" in capsys.readouterr().out
    assert lobstr_log([*arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["damage"] == "the file ends in the middle"


def test_a_profile_can_be_given(log: Path, tmp_path: Path) -> None:
    profile, out = tmp_path / "me.json", tmp_path / "out.ndjson"
    calibration = seen_in(log, None, lambda _: None, lambda *_: None).session.aim
    save_profile(profile, calibration)
    arguments = ["export", str(log), "--ndjson", str(out), "--refine", "--profile", str(profile)]
    assert lobstr_log(arguments) == 0
    first = json.loads(out.read_text(encoding="utf-8").splitlines()[0])
    assert first["joints"]["Hips"][1] == pytest.approx(1.0 / calibration.scale, rel=0.05)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (["--csv", "a.csv", "--refine"], "--bvh or --ndjson"),
        (["--bvh", "a.bvh", "--profile", "me.json"], "--refine only"),
    ],
)
def test_wrong_use_is_told(
    log: Path, capsys: pytest.CaptureFixture[str], wrong: list[str], words: str
) -> None:
    with pytest.raises(SystemExit) as ended:
        lobstr_log(["export", str(log), *wrong])
    assert ended.value.code == 2
    assert words in capsys.readouterr().err


def test_a_log_of_nobody_fails_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_log(
        tmp_path / "walk.mcap",
        made_take(seconds=3.0),
        lambda samples: [s for s in samples if s.time_s > 2.2],
    )
    assert lobstr_log(["export", str(path), "--bvh", str(tmp_path / "a.bvh"), "--refine"]) == 1
    assert "without a calibration" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["walk.mcap"]


def test_a_short_log_fails_with_what_it_needs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_log(
        tmp_path / "walk.mcap",
        made_take(seconds=3.0),
        lambda samples: [s for s in samples if s.time_s < 2.4],
    )
    assert lobstr_log(["export", str(path), "--bvh", str(tmp_path / "a.bvh"), "--refine"]) == 1
    assert "needs 2 s" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["walk.mcap"]
