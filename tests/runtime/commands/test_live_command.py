import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.made_logs import made_take, without, write_log

from lobstr_hw.bvh import read_bvh
from lobstr_hw.drivers.tracker_log import read_log
from lobstr_hw.predictors import SHIPPED_WEIGHTS
from lobstr_hw.runtime.commands.live import main
from lobstr_hw.runtime.sources import bundled_log
from lobstr_hw.simulation import SimulatedTake
from lobstr_hw.trackers import TrackerRole

MODULE = [sys.executable, "-m", "lobstr_hw.runtime.commands.live"]
EXTRAS = ("torch", "scipy", "matplotlib", "hid", "usb", "serial", "openvr", "xr", "viser")
SUMMARY_KEYS = {
    "frames",
    "rate_hz",
    "duration_s",
    "overruns",
    "tick_ms",
    "leg_delay_ms",
    "predictor",
    "nonfinite_frames",
    "gate_events",
    "tracker_loss",
    "foot_skate_cm_s",
}


def fast(log: Path, *more: str) -> list[str]:
    return ["--sim", str(log), "--fast", "--predictor", "standing", *more]


def one_message(capsys: pytest.CaptureFixture[str], *parts: str) -> str:
    """What stderr says: one line, no traceback."""
    err = capsys.readouterr().err
    lines = err.strip().splitlines()
    assert len(lines) == 1, err
    for part in parts:
        assert part in lines[0]
    return lines[0]


def test_a_log_becomes_files_and_a_summary(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bvh, ndjson, mcap = (tmp_path / name for name in ("o.bvh", "o.ndjson", "o.mcap"))
    summary = tmp_path / "s.json"
    sinks = ["--output", f"bvh:{bvh}", "--output", f"ndjson:{ndjson}", "--output", f"mcap:{mcap}"]
    assert main(fast(log, *sinks, "--summary", str(summary), "--take", "monday")) == 0
    report = json.loads(summary.read_text(encoding="utf-8"))
    assert report.keys() >= SUMMARY_KEYS
    rows = [json.loads(line) for line in ndjson.read_text(encoding="utf-8").splitlines()]
    skeleton = read_log(mcap).skeleton
    assert skeleton is not None
    assert len(read_bvh(bvh)) == len(rows) == len(skeleton.times_s) == report["frames"]
    assert rows[0]["time_s"] == 0.0
    assert report["leg_delay_ms"] == 10.0
    assert report["predictor"] == "standing"
    said = capsys.readouterr()
    assert said.out == ""
    assert f"{report['frames']} frames" in said.err


@pytest.mark.parametrize(("rate", "delay_ms"), [("90", 21.111), ("45", 10.0), ("22.5", 10.0)])
def test_the_legs_delay_is_told(
    log: Path, rate: str, delay_ms: float, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(fast(log, "--duration", "0.5", "--rate", rate, "--json")) == 0
    assert json.loads(capsys.readouterr().out)["leg_delay_ms"] == delay_ms


def test_json_is_one_document_and_quiet_is_quiet(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(fast(log, "--duration", "1", "--json", "--quiet")) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["frames"] == 46
    assert said.err == ""


def test_a_missing_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(fast(tmp_path / "no.mcap")) == 1
    one_message(capsys, "no.mcap", "No such file", "tracker log")


def test_what_is_no_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.mcap").write_bytes(b"hello" * 1000)
    assert main(fast(tmp_path / "x.mcap", "--json")) == 1
    said = capsys.readouterr()
    assert "is not a tracker log" in json.loads(said.out)["error"]


def test_a_log_without_the_pelvis_says_what_was_seen(
    tmp_path: Path, take: SimulatedTake, capsys: pytest.CaptureFixture[str]
) -> None:
    path = without(take, TrackerRole.PELVIS, tmp_path / "three.mcap")
    assert main(fast(path)) == 1
    one_message(capsys, "pelvis", f"head ({take.serials[TrackerRole.HEAD]})", "lobstr-calibrate")


def test_a_log_without_a_t_pose_says_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_log(tmp_path / "walk.mcap", made_take(t_pose_s=0.0))
    summary = tmp_path / "s.json"
    assert main(fast(path, "--summary", str(summary), "--quiet")) == 1
    one_message(capsys, "no T-pose found", "--profile FILE")
    assert json.loads(summary.read_text(encoding="utf-8"))["calibrated_at_s"] is None


def test_a_cut_log_is_played_as_far_as_it_goes(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[:-200])
    assert main(fast(cut, "--quiet")) == 0
    one_message(capsys, "cut.mcap", "going on with", "lobstr-log repair")


def test_weights_of_another_feature_version_are_refused(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = json.loads(SHIPPED_WEIGHTS.with_suffix(".json").read_text(encoding="utf-8"))
    card["feature_version"] = 99
    (tmp_path / "old.json").write_text(json.dumps(card), encoding="utf-8")
    shutil.copy(SHIPPED_WEIGHTS, tmp_path / "old.onnx")
    assert main(["--sim", str(log), "--fast", "--predictor", str(tmp_path / "old.onnx")]) == 1
    one_message(capsys, "99", "feature")


def test_a_missing_or_broken_profile(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(fast(log, "--profile", str(tmp_path / "me.json"))) == 1
    one_message(capsys, "no such profile", "lobstr-calibrate")
    (tmp_path / "me.json").write_text("{}", encoding="utf-8")
    assert main(fast(log, "--profile", str(tmp_path / "me.json"))) == 1
    one_message(capsys, "format is missing")


def test_what_cannot_be_written_is_told_before_anything_starts(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nowhere = tmp_path / "no"
    assert main(fast(log, "--output", f"bvh:{nowhere / 'o.bvh'}")) == 1
    one_message(capsys, "make it first")
    assert main(fast(log, "--summary", str(nowhere / "s.json"))) == 1
    one_message(capsys, "make it first")


def test_the_log_being_replayed_is_never_overwritten(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = log.read_bytes()
    assert main(fast(log, "--output", f"mcap:{log}")) == 1
    one_message(capsys, "choose another file")
    assert log.read_bytes() == before


def test_without_a_source_it_says_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 1
    err = capsys.readouterr().err
    assert "replay" in err
    assert "lobstr-live --sim" in err


@pytest.mark.parametrize(
    "wrong",
    [
        ["--sim", "--output", "nosuch:x"],
        ["--sim", "--output", "out.bvh"],
        ["--sim", "--driver", "fake"],
        ["--sim", "--rate", "5"],
        ["--sim", "--rate", "fast"],
        ["--sim", "--duration", "-1"],
        ["--sim", "--json", "--output", "ndjson:-"],
        ["--sim", "--output", "bvh:x", "--output", "ndjson:x"],
        ["--driver", "fake", "--fast"],
        ["--nosuch"],
    ],
)
def test_wrong_use_is_exit_code_2(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(wrong)
    assert left.value.code == 2
    assert "usage: lobstr-live" in capsys.readouterr().err


@pytest.mark.parametrize("driver", ["nosuch", "fake:colour=red", "replay", "fake:role=nose"])
def test_an_unknown_driver_or_option_is_wrong_use(
    driver: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--driver", driver]) == 2
    one_message(capsys, driver.partition(":")[0])


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["--help"])
    assert left.value.code == 0
    assert "lobstr-live --sim" in capsys.readouterr().out


def test_starting_brings_no_extras() -> None:
    code = (
        "import sys, lobstr_hw.runtime.commands.live, lobstr_hw.runtime.live;"
        f"print([m for m in {EXTRAS} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.skipif(os.name == "nt", reason="Windows sends Ctrl-Break to process groups only")
def test_a_signal_ends_cleanly_with_all_files_closed(name: str, log: Path, tmp_path: Path) -> None:
    bvh, mcap, summary = tmp_path / "o.bvh", tmp_path / "o.mcap", tmp_path / "s.json"
    sinks = ["--output", "ndjson:-", "--output", f"bvh:{bvh}", "--output", f"mcap:{mcap}"]
    command = [*MODULE, "--driver", "fake", "--predictor", "standing", "--summary", str(summary)]
    with subprocess.Popen(
        [*command, *sinks], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        lines = [child.stdout.readline() for _ in range(20)]
        child.send_signal(getattr(signal, name))
        out, err = child.communicate(timeout=20)
    assert child.returncode == 0, err
    assert "Traceback" not in err
    rows = [json.loads(line) for line in (*lines, *out.splitlines())]
    report = json.loads(summary.read_text(encoding="utf-8"))
    assert len(rows) == report["frames"] == len(read_bvh(bvh))
    assert not read_log(mcap).damage


def test_a_reader_that_goes_away_is_told_without_a_traceback(log: Path) -> None:
    command = [*MODULE, *fast(log, "--output", "ndjson:-", "--quiet")]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        child.stdout.readline()
        child.stdout.close()
        err = child.stderr.read()
        child.wait(20)
    assert child.returncode == 1
    assert "Traceback" not in err
    assert "ndjson:-" in err


def test_the_bundled_log_plays(capsys: pytest.CaptureFixture[str]) -> None:
    if not bundled_log().exists():
        pytest.skip("the bundled log is made by tools/make_demo_log.py")
    assert main(["--sim", "--fast", "--duration", "6", "--json", "--quiet"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["nonfinite_frames"] == 0
    assert report["calibrated_at_s"] < 4.0
