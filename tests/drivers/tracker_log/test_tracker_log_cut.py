"""A log whose writer died, or whose bytes were damaged, is read as far as it goes."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter, container, read_log, repair_log
from lobstr_hw.trackers import TrackerSample

CHILD = """
import sys
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter, container

writer = TrackerLogWriter(sys.argv[1])
with FakeDriver() as driver:
    for k in range(10_000_000):
        writer.add_samples(driver.poll(k / 45))
        print(k / 45, flush=True)
"""


def told(samples: list[TrackerSample]) -> list[tuple[str, float]]:
    return [(sample.serial, round(sample.time_s, 6)) for sample in samples]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A file as it is while recording, before its end is written."""
    path = tmp_path_factory.mktemp("log") / "open.mcap"
    writer = TrackerLogWriter(path)
    with FakeDriver() as driver:
        writer.add_samples(driver.poll(2.0))
    content = path.read_bytes()
    writer.close()
    return content


def test_a_killed_writer_loses_at_most_a_tenth_of_a_second(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    command = [sys.executable, "-c", CHILD, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        lines = [child.stdout.readline() for _ in range(150)]
        child.kill()
        lines += child.stdout.readlines()
    last_s = max(float(line) for line in lines if line.endswith("\n"))
    log = read_log(path)
    assert log.cut
    assert last_s > 3.0
    assert log.duration_s >= last_s - 0.1


def test_a_recording_cut_anywhere_is_read_up_to_the_cut(tmp_path: Path, recording: bytes) -> None:
    path = tmp_path / "cut.mcap"
    with FakeDriver() as driver:
        whole = told(list(driver.poll(2.0)))
    path.write_bytes(recording)
    assert len(told(list(read_log(path).samples()))) == len(whole)
    random = np.random.default_rng(0)
    counts = []
    for size in sorted(random.integers(2000, len(recording), 60)):
        path.write_bytes(recording[:size])
        log = read_log(path)
        samples = list(log.samples())
        assert log.cut and log.damage == "the file ends in the middle"
        assert told(samples) == whole[: len(samples)]
        counts.append(len(samples))
    assert counts == sorted(counts)
    bytes_per_sample = len(recording) / len(whole)
    assert counts[-1] > size / bytes_per_sample - 20, "what is on disk is read"


def test_damage_in_the_middle_ends_the_reading_there(tmp_path: Path, recording: bytes) -> None:
    path = tmp_path / "damaged.mcap"
    random = np.random.default_rng(1)
    for at in random.integers(3000, len(recording) - 500, 40):
        content = bytearray(recording)
        content[at : at + 200] = random.bytes(200)
        path.write_bytes(content)
        log = read_log(path)
        assert log.cut
        assert 0 < sum(map(len, log.trackers)) < 724


def test_a_damaged_compressed_log_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(container, "CHUNK_BYTES", 100_000)  # several of them
    path = tmp_path / "a.mcap"
    with TrackerLogWriter(path) as writer, FakeDriver() as driver:
        writer.add_samples(driver.poll(12.0))
    content = bytearray(path.read_bytes())
    assert not read_log(path).cut
    middle = int(0.6 * len(content))
    content[middle : middle + 64] = bytes(64)
    path.write_bytes(content)
    log = read_log(path)
    assert log.cut and "damaged" in log.damage
    assert 3.0 < log.duration_s < 11.0


def test_a_repaired_log_is_whole_and_holds_what_the_cut_one_held(
    tmp_path: Path, recording: bytes
) -> None:
    cut, whole = tmp_path / "cut.mcap", tmp_path / "whole.mcap"
    cut.write_bytes(recording[: int(0.7 * len(recording))])
    repaired = repair_log(cut, whole)
    before, after = read_log(cut), read_log(whole)
    assert repaired.damage == before.damage != ""
    assert not after.cut
    assert told(list(before.samples())) == told(list(after.samples()))
    assert before.tracker("FAKE-HEAD").states == after.tracker("FAKE-HEAD").states
    for a, b in zip(before.trackers, after.trackers, strict=True):
        np.testing.assert_array_equal(a.p, b.p)


def test_repairing_a_whole_log_changes_nothing_in_it(tmp_path: Path) -> None:
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    with TrackerLogWriter(first) as writer, FakeDriver() as driver:
        writer.mark_t_pose(0.0, 3.0)
        writer.attach_profile(b"{}")
        writer.add_samples(driver.poll(1.0))
    assert repair_log(first, second).damage == ""
    a, b = read_log(first), read_log(second)
    assert told(list(a.samples())) == told(list(b.samples()))
    assert (a.t_pose_s, a.profile, a.metadata) == (b.t_pose_s, b.profile, b.metadata)


def test_a_log_can_be_repaired_onto_itself(tmp_path: Path, recording: bytes) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(recording[: len(recording) // 2])
    before = told(list(read_log(path).samples()))
    repair_log(path, path)
    log = read_log(path)
    assert not log.cut
    assert told(list(log.samples())) == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]
