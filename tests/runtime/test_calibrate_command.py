"""``lobstr-calibrate``: exit codes, messages, and the profile it leaves."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.fake_clock import FakeClock
from support.motions import arms_down, walking
from support.two_fakes import two_fakes

from lobstr_hw.calibration import load_profile
from lobstr_hw.drivers.fake import OTHER_SPACE
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.motion import Motion
from lobstr_hw.runtime.commands.calibrate import main
from lobstr_hw.runtime.profile_path import default_profile_path
from lobstr_hw.runtime.recording import Recorder
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.simulation import SimulatedTake, simulate, take_samples
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackingState


def write_log(path: Path, take: SimulatedTake, without: TrackerRole | None = None) -> Path:
    roles = [role for role in FOUR_POINTS if role != without]
    kept = {take.serials[role] for role in roles}
    with TrackerLogWriter(path) as writer:
        for role in roles:
            writer.add_state(take.serials[role], role, TrackingState.OK, True, 0.0)
        writer.add_samples([s for s in take_samples(take) if s.serial in kept])
    return path


def a_take(motion: Motion | None = None, t_pose_s: float = 3.0) -> SimulatedTake:
    return simulate(motion or walking(1.0), 5, t_pose_s=t_pose_s)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_log(tmp_path_factory.mktemp("log") / "take.mcap", a_take())


def test_the_t_pose_of_a_log_becomes_a_profile(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "me.json"
    assert main(["--sim", str(log), "--yes", "--profile", str(path)]) == 0
    assert set(load_profile(path).roles.values()) == set(FOUR_POINTS)
    out = capsys.readouterr().out
    assert "T-pose" in out
    assert str(path) in out.replace("\n", "")


def test_json_is_one_document_that_agrees_with_the_profile(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "me.json"
    assert main(["--sim", str(log), "--yes", "--json", "--profile", str(path)]) == 0
    document = json.loads(capsys.readouterr().out)
    profile = load_profile(path)
    assert document["scale"] == pytest.approx(profile.scale)
    assert document["trackers"] == {s: str(r) for s, r in profile.roles.items()}
    assert document["verdict"] in ("good", "fair", "poor")


def test_the_same_log_gives_the_same_profile_byte_for_byte(log: Path, tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a.json", "b.json")]
    for path in paths:
        assert main(["--sim", str(log), "--yes", "--profile", str(path)]) == 0
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_height_that_is_given_is_in_the_profile(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "me.json"
    assert main(["--sim", str(log), "--yes", "--height", "181", "--profile", str(path)]) == 0
    assert load_profile(path).stature_m == pytest.approx(1.81, abs=0.003)


def test_an_old_profile_is_kept_when_nobody_can_be_asked(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "me.json"
    path.write_text("old", encoding="utf-8")
    assert main(["--sim", str(log), "--profile", str(path)]) == 1
    assert path.read_text(encoding="utf-8") == "old"
    assert "--yes" in capsys.readouterr().err


@pytest.mark.parametrize(("answer", "code"), [("y\n", 0), ("no\n", 1), ("\n", 1)])
def test_a_person_is_asked_before_an_old_profile_is_replaced(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answer: str, code: int
) -> None:
    path = tmp_path / "me.json"
    path.write_text("old", encoding="utf-8")
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stdin.readline", lambda: answer, raising=False)
    assert main(["--sim", str(log), "--profile", str(path)]) == code
    assert (path.read_text(encoding="utf-8") == "old") == bool(code)


def test_json_stays_one_document_when_nothing_is_written(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "me.json"
    path.write_text("old", encoding="utf-8")
    assert main(["--sim", str(log), "--json", "--profile", str(path)]) == 1
    assert "left as it was" in json.loads(capsys.readouterr().out)["error"]


def test_being_stopped_leaves_the_old_profile_and_says_so(
    log: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "me.json"
    monkeypatch.setattr("lobstr_hw.runtime.stopping.StopRequest.__call__", lambda self: True)
    assert main(["--sim", str(log), "--yes", "--json", "--profile", str(path)]) == 0
    assert json.loads(capsys.readouterr().out) == {"stopped": True}
    assert not path.exists()


def test_a_cut_log_is_used_as_far_as_it_goes(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.mcap"
    whole = log.read_bytes()
    cut.write_bytes(whole[: int(0.8 * len(whole))])
    path = tmp_path / "me.json"
    assert main(["--sim", str(cut), "--yes", "--profile", str(path)]) == 0
    assert "cut.mcap" in capsys.readouterr().err


def test_without_a_profile_option_it_goes_to_the_configuration_folder(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platformdirs.user_config_path", lambda *_, **__: tmp_path / "config")
    assert main(["--sim", str(log)]) == 0
    assert load_profile(default_profile_path()).scale > 0.0


def test_a_missing_log_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--sim", str(tmp_path / "none.mcap"), "--yes"]) == 1
    assert "none.mcap" in capsys.readouterr().err


def test_a_log_without_the_pelvis_is_told_with_what_was_seen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    take = a_take()
    log = write_log(tmp_path / "three.mcap", take, without=TrackerRole.PELVIS)
    profile = tmp_path / "me.json"
    assert main(["--sim", str(log), "--yes", "--profile", str(profile)]) == 1
    message = capsys.readouterr().err
    assert "no tracker for pelvis" in message
    assert take.serials[TrackerRole.LEFT_HAND] in message
    assert not profile.exists()


@pytest.mark.parametrize("motion", [walking(3.0), arms_down(3.0)])
def test_a_log_without_a_t_pose_is_told_with_how_close_it_came(
    motion: Motion, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "walk.mcap", a_take(motion, t_pose_s=0.0))
    profile = tmp_path / "me.json"
    assert main(["--sim", str(log), "--yes", "--json", "--profile", str(profile)]) == 1
    output = capsys.readouterr()
    assert "no T-pose found" in json.loads(output.out)["error"]
    assert "wanted" in output.err
    assert not profile.exists()


def test_without_a_source_it_says_which_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 1
    message = capsys.readouterr().err
    assert "--driver" in message
    assert "fake: ready" in message


@pytest.mark.parametrize(
    "arguments",
    [
        ["--height", "17"],
        ["--height", "tall"],
        ["--floor", "-1"],
        ["--countdown", "999"],
        ["--timeout", "0"],
        ["--timeout", "soon"],
        ["--sim", "take.mcap", "--driver", "fake"],
        ["--sim", "take.mcap", "--countdown", "3"],
        ["--what"],
    ],
)
def test_wrong_use_leaves_with_2(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2


def test_a_profile_that_cannot_be_written_is_told(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    assert main(["--sim", str(log), "--yes", "--profile", str(blocked / "me.json")]) == 1
    assert "cannot be written" in capsys.readouterr().err


# a log of two tracking systems


def mixed_log(path: Path, script: str, seconds: float, profile: str = "") -> Path:
    with two_fakes(script) as driver:
        writer = TrackerLogWriter(path)
        if profile:
            writer.attach_profile(profile.encode())
        table = RoleTable(None, driver.devices)
        Recorder(driver, writer, table, FakeClock(0.0), 45.0).run(lambda: False, seconds)
        writer.close()
    return path


def test_a_log_of_two_systems_is_joined_by_the_movement_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, log = tmp_path / "me.json", mixed_log(tmp_path / "mixed.mcap", "join", 36.0)
    assert main(["--sim", str(log), "--yes", "--profile", str(path)]) == 0
    assert "Tracking spaces" in capsys.readouterr().out
    first = load_profile(path)
    T = first.tracking_spaces["belt"].T_world_space @ OTHER_SPACE
    np.testing.assert_allclose(T.p, 0.0, atol=2e-3)
    # once known, the movement need not be in every log
    text = path.read_text(encoding="utf-8")
    again, later = tmp_path / "again.json", tmp_path / "later.mcap"
    mixed_log(later, "calibrate", 20.0, profile=text)
    assert main(["--sim", str(later), "--yes", "--profile", str(again)]) == 0
    second = load_profile(again)
    for name in ("vr", "belt"):
        a, b = (p.tracking_spaces[name].T_world_space for p in (first, second))
        np.testing.assert_allclose(a.p, b.p, atol=1e-9)
    assert second.scale == pytest.approx(first.scale, rel=0.01)


def test_a_log_of_two_systems_that_nothing_joins_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, log = tmp_path / "me.json", mixed_log(tmp_path / "apart.mcap", "calibrate", 12.0)
    assert main(["--sim", str(log), "--yes", "--profile", str(path)]) == 1
    assert not path.exists()
    message = capsys.readouterr().err
    assert "vr and belt are not joined" in message
    assert "Hold one tracker of each firmly together" in message
