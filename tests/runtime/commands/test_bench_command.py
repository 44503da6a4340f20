"""``lobstr-bench``, as its user types it."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("scipy", reason="pip install 'lobstr-hw[lighthouse]'")

from lobstr_hw.drivers.lighthouse.made_room import made_device, made_reports, made_stations
from lobstr_hw.drivers.lighthouse.tracked_device import TrackedDevice
from lobstr_hw.runtime.commands import bench_lighthouse
from lobstr_hw.runtime.commands.bench import main


def test_a_device_of_the_made_room_is_tracked_from_its_first_quarter_of_a_second_on() -> None:
    device = TrackedDevice(made_device("a"), made_stations())
    for data in made_reports(0.6, 1):
        device.feed(data)
    poses = device.poses()
    assert len(poses) > 0.3 * 250
    assert poses.tracked.all()


def test_the_made_room_is_measured(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lighthouse", "--seconds", "0.3", "--json"]) == 0
    said = capsys.readouterr()
    document = json.loads(said.out)
    (run,) = document["runs"]
    assert run["devices"] == 3 and run["events"] > 500
    assert document["live"]["paced"] > 0.0
    assert "three trackers" in said.err


def test_a_file_that_is_none_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "none.pcap"
    assert main(["lighthouse", str(path), "--seconds", "0.1"]) == 1
    assert str(path) in capsys.readouterr().err


def test_a_failure_is_a_document_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "none.pcap"
    assert main(["lighthouse", str(path), "--seconds", "0.1", "--json"]) == 1
    assert str(path) in json.loads(capsys.readouterr().out)["error"]


def test_who_stops_it_gets_no_success(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object) -> Iterator[bench_lighthouse.Run]:
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(bench_lighthouse, "measure", stopped)
    assert main(["lighthouse", "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == {"stopped": True}
