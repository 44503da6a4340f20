import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.bad_drivers import BrokenProbeDriver, HangingDriver, UnopenedDriver

from lobstr_hw.drivers import DRIVERS
from lobstr_hw.runtime import device_watch
from lobstr_hw.runtime.commands import devices
from lobstr_hw.runtime.commands.devices import main

KEYS = {"name", "available", "missing", "fix", "devices"}
DEVICE_KEYS = {"serial", "kind", "model", "role_hint", "firmware", "battery", "worn"}
QUICK_S = 0.05


@pytest.fixture(autouse=True)
def table(monkeypatch: pytest.MonkeyPatch) -> dict[str, tuple[str, str]]:
    """A table of our own: what this machine has must not decide a test."""
    known = {"fake": DRIVERS["fake"], "replay": DRIVERS["replay"]}
    monkeypatch.setattr("lobstr_hw.drivers.DRIVERS", known)
    monkeypatch.setattr(devices, "DRIVERS", known)
    monkeypatch.setattr(device_watch, "LISTEN_S", QUICK_S)
    return known


@pytest.fixture
def bad(table: dict[str, tuple[str, str]]) -> Iterator[None]:
    names = ("BrokenPoll", "BrokenProbe", "Busy", "Hanging", "Missing", "Unopened")
    table |= {name.lower(): ("support.bad_drivers", f"{name}Driver") for name in names}
    yield
    HangingDriver.let_go.set()


def documents(capsys: pytest.CaptureFixture[str], *argv: str) -> tuple[dict[str, Any], str]:
    """What --json gives by name, and what was said beside it."""
    assert main([*argv, "--json"]) == 0
    said = capsys.readouterr()
    return {row["name"]: row for row in json.loads(said.out)}, said.err


def test_there_is_one_object_for_each_driver(capsys: pytest.CaptureFixture[str]) -> None:
    found, err = documents(capsys)
    assert list(found) == ["fake", "replay"]
    assert all(row.keys() == KEYS for row in found.values())
    assert all(device.keys() >= DEVICE_KEYS for device in found["fake"]["devices"])
    roles = {device["serial"]: device["role_hint"] for device in found["fake"]["devices"]}
    assert roles["FAKE-PELVIS"] == "pelvis"
    assert {device["state"] for device in found["fake"]["devices"]} == {"ok"}
    assert err == ""


def test_a_driver_that_wants_a_file_is_opened_only_when_named(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found, _ = documents(capsys)
    assert found["replay"]["available"]
    assert found["replay"]["devices"] == []
    assert found["replay"]["fix"] == "lobstr-devices --driver replay:file=..."
    found, _ = documents(capsys, "--driver", f"replay:file={log}")
    assert len(found["replay"]["devices"]) == 4
    assert found["replay"]["fix"] == ""


def test_two_of_one_kind_stand_in_one_object(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    specs = ("--driver", f"replay:file={log}", "--driver", f"replay:file={tmp_path / 'no'}")
    found, _ = documents(capsys, *specs)
    assert list(found) == ["fake", "replay"]
    assert len(found["replay"]["devices"]) == 4
    assert "No such file" in found["replay"]["missing"]


@pytest.mark.usefixtures("bad")
def test_bad_drivers_are_told_and_the_rest_goes_on(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(device_watch, "ANSWER_S", 0.3)
    monkeypatch.setattr(devices, "ANSWER_S", 0.3)
    names = ("brokenpoll", "brokenprobe", "busy", "hanging")
    found, err = documents(capsys, *(f"--driver={name}" for name in names))
    assert len(found["fake"]["devices"]) == 4
    assert not found["hanging"]["available"]
    assert "no answer" in found["hanging"]["missing"]
    assert "RuntimeError: ouch" in found["brokenprobe"]["missing"]
    assert "ZeroDivisionError" in found["brokenpoll"]["missing"]
    assert found["busy"]["missing"] == "the dongle is in use"
    assert found["busy"]["fix"] == "Close the other program."
    assert found["missing"]["missing"] == "the Python package snake"
    assert found["missing"]["fix"] == "pip install snake"
    lines = err.splitlines()
    assert len(lines) == 3
    for name in ("hanging", "brokenprobe", "brokenpoll"):
        assert sum(f"the driver {name} " in line for line in lines) == 1


@pytest.mark.usefixtures("bad")
def test_nothing_is_opened_that_was_not_named(capsys: pytest.CaptureFixture[str]) -> None:
    found, _ = documents(capsys)
    assert found["unopened"]["available"]
    assert UnopenedDriver.opened == 0
    documents(capsys, "--driver", "unopened")
    assert UnopenedDriver.opened == 1


@pytest.mark.usefixtures("bad")
def test_a_fault_that_comes_again_and_again_is_told_once(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(device_watch, "RETRY_S", 0.01)
    BrokenProbeDriver.probes = 0
    _, err = documents(capsys, "--driver", "brokenprobe")
    assert BrokenProbeDriver.probes > 2
    assert err.count("ouch") == 1


@pytest.mark.usefixtures("bad")
def test_the_table_shows_devices_and_the_command_that_mends_the_rest(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert main([]) == 0
    out = capsys.readouterr().out
    for part in ("FAKE-PELVIS", "left hand", "100%", "missing: the Python package snake"):
        assert part in out
    assert "pip install snake" in out


def test_an_unknown_driver_is_wrong_use(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["--driver", "nosuch"])
    assert left.value.code == 2
    assert "known: fake, replay" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="Windows sends Ctrl-Break to process groups only")
def test_watching_ends_cleanly_by_ctrl_c_with_one_document() -> None:
    code = "from lobstr_hw.runtime.commands.devices import main; main(['--watch', '--json'])"
    with subprocess.Popen(
        [sys.executable, "-c", f"{code}; print('after', flush=True)"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as child:
        assert child.stderr is not None
        line = ""
        while "driver" not in line and child.poll() is None:
            line = child.stderr.readline()
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=20)
    assert child.returncode == 0, err
    document, after = out.rsplit("\n", 2)[:2]
    assert after == "after"
    assert {row["name"] for row in json.loads(document)} >= {"fake", "replay"}
