import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from support.calibrations import calibrated
from support.waiting import wait_until

from lobstr_hw.calibration import save_profile
from lobstr_hw.drivers import DRIVERS
from lobstr_hw.drivers.tracker_log import read_log
from lobstr_hw.runtime.commands.record import main
from lobstr_hw.simulation import SimulatedTake

MODULE = [sys.executable, "-m", "lobstr_hw.runtime.commands.record"]
QUICK = ["--driver", "fake", "--duration", "0.2", "--quiet"]
UNIX = pytest.mark.skipif(os.name == "nt", reason="Windows has no such signal for one process")


def child_of(path: Path, *more: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [*MODULE, str(path), "--driver", "fake", *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_bytes(path: Path, count: int) -> None:
    wait_until(lambda: path.exists() and path.stat().st_size > count, f"{count} bytes", 20.0)


def test_a_recording_is_a_whole_log_with_roles_and_the_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.mcap"
    assert main([str(path), *QUICK, "--json"]) == 0
    said = capsys.readouterr()
    report = json.loads(said.out)
    assert said.err == ""
    log = read_log(path)
    assert not log.cut
    assert log.unix_offset_s is not None
    assert log.unix_offset_s + log.start_s == pytest.approx(time.time(), abs=60.0)
    assert {track.role for track in log.trackers} == {t["role"] for t in report["trackers"]}
    assert {"head", "left_hand", "right_hand", "pelvis"} == {t["role"] for t in report["trackers"]}
    assert sum(t["samples"] for t in report["trackers"]) == sum(map(len, log.trackers))
    assert report["bytes"] == path.stat().st_size


def test_what_is_there_is_not_overwritten_without_being_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"precious")
    assert main([str(path), *QUICK]) == 1
    assert "--force" in capsys.readouterr().err
    assert path.read_bytes() == b"precious"
    assert main([str(path), *QUICK, "--force"]) == 0
    assert read_log(path).trackers


def test_a_device_that_is_missing_costs_no_old_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"precious")
    driver = f"replay:file={tmp_path / 'no.mcap'}"
    assert main([str(path), "--driver", driver, "--force"]) == 1
    assert "no.mcap" in capsys.readouterr().err
    assert path.read_bytes() == b"precious"


def test_a_folder_that_is_missing_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path / "no" / "a.mcap"), *QUICK, "--json"]) == 1
    assert "folder" in json.loads(capsys.readouterr().out)["error"]


def test_a_profile_names_the_trackers_and_goes_into_the_log(
    tmp_path: Path, take: SimulatedTake, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_profile(tmp_path / "me.json", calibrated(take))
    source = ["--driver", f"replay:file={log}", "--profile", str(tmp_path / "me.json")]
    assert main([str(tmp_path / "a.mcap"), *source, "--duration", "0.2", "--quiet"]) == 0
    recorded = read_log(tmp_path / "a.mcap")
    assert recorded.profile is not None
    assert {t.serial: t.role for t in recorded.trackers} == {
        serial: role for role, serial in take.serials.items()
    }


def test_nothing_to_record_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    known = {**DRIVERS, "quiet": ("support.bad_drivers", "QuietDriver")}
    monkeypatch.setattr("lobstr_hw.drivers.DRIVERS", known)
    path = tmp_path / "a.mcap"
    assert main([str(path), "--driver", "quiet", "--duration", "0.1", "--json"]) == 1
    said = capsys.readouterr()
    assert json.loads(said.out)["file"] is None
    assert "lobstr-devices" in said.err
    assert not path.exists()


@pytest.mark.parametrize(
    "wrong", [[], ["a.mcap", "--rate", "0"], ["a.mcap", "--duration", "-1"], ["a", "--nosuch"]]
)
def test_wrong_use_of_record_is_exit_code_2(
    wrong: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(wrong)
    assert left.value.code == 2
    assert "usage: lobstr-record" in capsys.readouterr().err


def test_an_unknown_driver_to_record_is_wrong_use(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path / "a.mcap"), "--driver", "nosuch"]) == 2
    assert "nosuch" in capsys.readouterr().err


def test_raw_needs_the_driver_that_reads_usb(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    raw = tmp_path / "a.pcap"
    assert main([str(tmp_path / "a.mcap"), *QUICK, "--raw", str(raw)]) == 2
    assert "--driver lighthouse" in capsys.readouterr().err
    raw.write_bytes(b"something")
    assert main([str(tmp_path / "a.mcap"), "--driver", "lighthouse", "--raw", str(raw)]) == 1
    assert f"{raw} exists" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [raw]


class SmallDisk(io.FileIO):
    """A disk that is full after so many bytes."""

    left = 0

    def write(self, data: Any) -> int:
        view = memoryview(data)
        if not SmallDisk.left:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written = super().write(view[: SmallDisk.left])
        SmallDisk.left -= written
        return written


@pytest.mark.parametrize("room", [20_000, 50_000])
def test_a_full_disk_ends_the_recording_and_keeps_what_is_there(
    room: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def small(path: Path, mode: str = "r", *more: Any, **options: Any) -> Any:
        if mode == "wb":
            return io.BufferedWriter(SmallDisk(str(path), "wb"))
        return io.open(path, mode, *more, **options)  # noqa: UP020 - pathlib's own is patched

    SmallDisk.left = room
    monkeypatch.setattr(Path, "open", small)
    path = tmp_path / "a.mcap"
    assert main([str(path), "--driver", "fake", "--duration", "5", "--quiet", "--json"]) == 1
    said = capsys.readouterr()
    report = json.loads(said.out)
    assert "No space left" in report["error"]
    assert report["duration_s"] < 5.0
    assert said.err.count("No space left") == 1
    assert "lobstr-log repair" in said.err
    assert path.stat().st_size == room
    log = read_log(path)
    kept = sum(map(len, log.trackers))
    recorded = sum(t["samples"] for t in report["trackers"])
    assert recorded - 8 <= kept <= recorded + 4


def test_a_disk_that_is_full_when_compressing_keeps_the_whole_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def no_room(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("lobstr_hw.drivers.tracker_log.writer.copy_compressed", no_room)
    path = tmp_path / "a.mcap"
    assert main([str(path), *QUICK]) == 1
    assert "No space left" in capsys.readouterr().err
    assert not read_log(path).cut


@UNIX
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_finishes_the_log(name: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with child_of(path, "--json") as child:
        wait_for_bytes(path, 30_000)
        child.send_signal(getattr(signal, name))
        out, err = child.communicate(timeout=20)
    assert child.returncode == 0, err
    assert "Traceback" not in err
    log = read_log(path)
    assert not log.cut
    assert sum(map(len, log.trackers)) == sum(t["samples"] for t in json.loads(out)["trackers"])


def lost_by_a_kill(path: Path) -> float:
    """Seconds between a kill and the last sample that can be read afterwards."""
    with child_of(path) as child:
        wait_for_bytes(path, 40_000)
        killed_s = time.time()
        child.kill()
        child.wait(20)
    log = read_log(path)
    assert log.cut
    assert log.unix_offset_s is not None
    return killed_s - (log.unix_offset_s + log.start_s + log.duration_s)


def test_a_kill_loses_at_most_a_tenth_of_a_second(tmp_path: Path) -> None:
    # where the machine itself stands still for so long, a second try may
    lost_s = [lost_by_a_kill(tmp_path / f"{i}.mcap") for i in range(2)]
    assert min(lost_s) < 0.1
    assert min(lost_s) > -0.1


def test_without_drivers_it_says_what_there_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path / "a.mcap")]) == 1
    assert "openvr" in capsys.readouterr().err
    assert not (tmp_path / "a.mcap").exists()
