"""``lobstr-log``, as its user types it."""

import csv
import gzip
import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.bvh import read_bvh
from lobstr_hw.bvh_writer import write_bvh
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter, read_log
from lobstr_hw.poses import PartialPose
from lobstr_hw.runtime.commands.log import main
from lobstr_hw.skeleton import HUMANOID_NAMES, STANDARD_OFFSETS, Body, forward_kinematics
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample, TrackingState

CLIP_S = 3.0


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    motion = walking(CLIP_S, seed=4)
    path = tmp_path_factory.mktemp("clip") / "walk.bvh"
    write_bvh(path, motion.p_hips, motion.R_local, motion.rate_hz)
    return path


@pytest.fixture(scope="module")
def made(clip: Path) -> Path:
    path = clip.with_name("walk.mcap")
    assert main(["make", str(clip), str(path), "--seed", "3", "--height", "172"]) == 0
    return path


def document(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    """Run with --json; standard output must be one document and nothing else."""
    capsys.readouterr()
    assert main([*map(str, arguments), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class TestMake:
    def test_it_puts_a_t_pose_of_3_s_and_four_trackers_at_90_hz_before_the_clip(
        self, made: Path
    ) -> None:
        log = read_log(made)
        assert {track.role for track in log.trackers} == set(FOUR_POINTS)
        assert log.t_pose_s == (0.0, 3.0)
        assert log.duration_s > 3.0 + CLIP_S
        for track in log.trackers:
            np.testing.assert_allclose(np.diff(track.times_s), 1 / 90, atol=2e-9)
        assert log.truth is not None
        np.testing.assert_allclose(np.diff(log.truth.times_s), 1 / 45, atol=2e-9)
        assert log.duration_s == pytest.approx(log.truth.times_s[-1], abs=0.02)

    def test_the_same_seed_makes_the_same_bytes_and_another_does_not(
        self, clip: Path, made: Path, tmp_path: Path
    ) -> None:
        again, other = tmp_path / "again.mcap", tmp_path / "other.mcap"
        main(["make", str(clip), str(again), "--seed", "3", "--height", "172"])
        main(["make", str(clip), str(other), "--seed", "4", "--height", "172"])
        assert again.read_bytes() == made.read_bytes() != other.read_bytes()

    def test_trackers_stay_where_they_were_strapped_on(self, made: Path) -> None:
        log = read_log(made)
        words = log.metadata["user"]
        truth = log.truth
        assert truth is not None and truth.R_world is not None
        joints = {TrackerRole.HEAD: 5, TrackerRole.PELVIS: 0}
        for role, joint in joints.items():
            track = next(track for track in log.trackers if track.role is role)
            mount = np.array([float(word) for word in words[f"T_{role}_tracker"].split()])
            here = np.searchsorted(track.times_s, truth.times_s - 1e-6)
            lever = (truth.R_world[:, joint] @ mount[:3, None])[..., 0]
            off = np.linalg.norm(track.p[here] - truth.p_world[:, joint] - lever, axis=-1)
            assert np.median(off) < 0.008, "jitter and drift are millimetres"

    def test_rate_and_height_are_what_was_asked_for(
        self, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "a.mcap"
        told = document(capsys, "make", clip, out, "--rate", 120, "--height", 160)
        assert told["stature_cm"] == 160.0
        info = document(capsys, "info", out)
        assert {tracker["rate_hz"] for tracker in info["trackers"]} == {120.0}
        assert told["bytes"] == info["bytes"] == out.stat().st_size

    @pytest.mark.parametrize("wrong", [["--rate", "0"], ["--height", "17"], ["--scale", "-1"]])
    def test_impossible_numbers_are_wrong_use(
        self, clip: Path, tmp_path: Path, wrong: list[str]
    ) -> None:
        with pytest.raises(SystemExit) as ended:
            main(["make", str(clip), str(tmp_path / "a.mcap"), *wrong])
        assert ended.value.code == 2

    def test_what_is_no_clip_fails_and_leaves_nothing(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        bad = tmp_path / "bad.bvh"
        bad.write_text("not a motion", encoding="utf-8")
        assert main(["make", str(bad), str(tmp_path / "a.mcap")]) == 1
        assert "bad.bvh" in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == ["bad.bvh"]

    def test_a_missing_folder_is_named(
        self, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert main(["make", str(clip), str(tmp_path / "none" / "a.mcap")]) == 1
        assert "make the folder" in capsys.readouterr().err


class TestInfo:
    def test_it_counts_drop_outs_jumps_and_broken_samples(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        path = tmp_path / "a.mcap"
        with TrackerLogWriter(path) as writer:
            for k in range(300):
                p = np.array([0.001 * k, 1.0 + (0.05 if 200 <= k < 210 else 0.0), 0.0])
                if k == 150:
                    p[1] = np.nan
                blind = 50 <= k < 60 or k >= 290
                state = TrackingState.OCCLUDED if blind else TrackingState.OK
                if not 100 <= k < 120:  # nothing arrives at all
                    pose = PartialPose(np.eye(3), p)
                    writer.add_sample(TrackerSample("A", pose, k / 100, not blind, state))
        (tracker,) = document(capsys, "info", path)["trackers"]
        assert tracker["samples"] == 280
        assert tracker["rate_hz"] == 100.0
        np.testing.assert_allclose(
            tracker["dropouts_s"], [[0.5, 0.6], [0.99, 1.2], [2.9, 2.99]], atol=1e-6
        )
        assert tracker["lost_s"] == pytest.approx(0.4)
        np.testing.assert_allclose(tracker["jumps_s"], [2.0, 2.1], atol=1e-6)
        assert tracker["broken_samples"] == 1

    def test_it_tells_a_cut_log_from_a_whole_one(
        self, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert document(capsys, "info", made)["whole"]
        cut = tmp_path / "cut.mcap"
        writer = TrackerLogWriter(cut)
        with FakeDriver() as driver:
            writer.add_samples(driver.poll(1.0))
        content = cut.read_bytes()
        writer.close()
        cut.write_bytes(content[:-50])
        found = document(capsys, "info", cut)
        assert not found["whole"]
        assert found["damage"] == "the file ends in the middle"
        assert main(["info", str(cut)]) == 0
        assert "lobstr-log repair" in capsys.readouterr().out

    def test_it_says_what_else_is_in_the_log(
        self, made: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        found = document(capsys, "info", made)
        assert found["t_pose_s"] == [0.0, 3.0]
        assert found["truth"]["rate_hz"] == 45.0
        assert found["skeleton"] is None
        assert found["metadata"]["made"]["clip"] == "walk.bvh"

    def test_a_missing_file_fails_with_advice_and_an_empty_standard_output(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert main(["info", str(tmp_path / "none.mcap"), "--json"]) == 1
        out, err = capsys.readouterr()
        assert out == ""
        assert "Give the path of a tracker log" in err


class TestExport:
    def test_csv_has_a_row_a_sample_in_time_order(self, made: Path, tmp_path: Path) -> None:
        assert main(["export", str(made), "--csv", str(tmp_path / "a.csv")]) == 0
        found = rows(tmp_path / "a.csv")
        log = read_log(made)
        assert len(found) == sum(map(len, log.trackers))
        times = [float(row["time_s"]) for row in found]
        assert times == sorted(times)
        for row, sample in zip(found, log.samples(), strict=True):
            assert row["serial"] == sample.serial
            assert row["tracked"] == str(int(sample.tracked))
            np.testing.assert_array_equal(
                [float(row[name]) for name in ("px", "py", "pz")], sample.T_world_tracker.p
            )

    def test_bvh_of_the_truth_is_the_truth(self, made: Path, tmp_path: Path) -> None:
        assert main(["export", str(made), "--bvh", str(tmp_path / "a.bvh")]) == 0
        truth = read_log(made).truth
        assert truth is not None
        found = read_bvh(tmp_path / "a.bvh")
        assert found.frame_time_s == pytest.approx(1 / 45, abs=1e-9)
        assert tuple(found.names) == HUMANOID_NAMES
        np.testing.assert_allclose(found.world()[0] / 100.0, truth.p_world, atol=5e-4)

    def test_ndjson_of_the_truth_is_the_truth(self, made: Path, tmp_path: Path) -> None:
        assert main(["export", str(made), "--ndjson", str(tmp_path / "a.ndjson")]) == 0
        truth = read_log(made).truth
        assert truth is not None
        lines = (tmp_path / "a.ndjson").read_text(encoding="utf-8").splitlines()
        for line, p, time_s in zip(lines, truth.p_world, truth.times_s, strict=True):
            frame = json.loads(line)
            assert frame["time_s"] == pytest.approx(time_s, abs=1e-6)
            found = np.array([joint[:3] for joint in frame["joints"].values()])
            np.testing.assert_allclose(found, p, atol=5e-4)
            assert set(frame["roles"]) == set(FOUR_POINTS)

    def test_frames_before_the_calibration_get_the_users_body_on_the_same_floor(
        self, tmp_path: Path
    ) -> None:
        log, out = tmp_path / "a.mcap", tmp_path / "a.ndjson"
        R = np.tile(np.eye(3), (1, 22, 1, 1))
        flags = np.ones((1, 2), bool)
        with TrackerLogWriter(log) as writer, FakeDriver() as driver:
            writer.add_samples(driver.poll(1.0))
            for k, hips_m in enumerate([1.0, 1.0, 0.9, 0.9]):
                body = Body.standard(1, hips_m)
                p, _ = forward_kinematics(R, np.array([[0.3, hips_m, 0.2]]), body.offsets)
                source = np.zeros((1, 22), np.int8)
                writer.add_skeleton(SkeletonPose(k / 45, p, R, flags, flags, source, {}))
        assert main(["export", str(log), "--ndjson", str(out)]) == 0
        frames = [json.loads(line) for line in out.read_text(encoding="utf-8").splitlines()]
        joints = np.array([list(frame["joints"].values()) for frame in frames])
        np.testing.assert_allclose(joints, np.broadcast_to(joints[-1], joints.shape), atol=2e-5)
        assert joints[0, 0, 1] == pytest.approx(0.9, abs=1e-5)

    def test_a_log_without_a_body_says_how_to_get_one(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        path = tmp_path / "a.mcap"
        with TrackerLogWriter(path) as writer, FakeDriver() as driver:
            writer.add_samples(driver.poll(0.1))
        assert main(["export", str(path), "--bvh", str(tmp_path / "a.bvh")]) == 1
        assert "lobstr-live --sim" in capsys.readouterr().err
        assert not (tmp_path / "a.bvh").exists()

    @pytest.mark.parametrize("wrong", [[], ["--gltf", "a.glb"], ["--csv", "a", "--bvh", "b"]])
    def test_no_kind_two_kinds_or_gltf_are_wrong_use(self, made: Path, wrong: list[str]) -> None:
        with pytest.raises(SystemExit) as ended:
            main(["export", str(made), *wrong])
        assert ended.value.code == 2


class TestImport:
    def test_exporting_and_importing_again_keeps_every_sample(
        self, made: Path, tmp_path: Path
    ) -> None:
        first, log, second = (tmp_path / name for name in ("a.csv", "b.mcap", "b.csv"))
        main(["export", str(made), "--csv", str(first)])
        zipped = tmp_path / "a.csv.gz"
        zipped.write_bytes(gzip.compress(first.read_bytes()))
        assert main(["import", str(zipped), str(log)]) == 0
        main(["export", str(log), "--csv", str(second)])
        for a, b in zip(rows(first), rows(second), strict=True):
            for name in ("time_s", "serial", "role", "px", "py", "pz", "tracked"):
                assert a[name] == b[name]
            for name in ("qx", "qy", "qz", "qw"):
                assert float(a[name]) == pytest.approx(float(b[name]), abs=2.1e-7)

    def test_unknown_positions_and_broken_numbers_survive(self, tmp_path: Path) -> None:
        log, table, back = (tmp_path / name for name in ("a.mcap", "a.csv", "b.mcap"))
        with TrackerLogWriter(log) as writer:
            for i, p in enumerate([None, np.array([np.nan, 0.0, 1.0]), np.ones(3)]):
                pose = PartialPose(np.eye(3), p)
                writer.add_sample(TrackerSample("A", pose, float(i), i < 2))
        main(["export", str(log), "--csv", str(table)])
        main(["import", str(table), str(back)])
        unknown, broken, lost = (s.T_world_tracker.p for s in read_log(back).samples())
        assert unknown is None
        np.testing.assert_array_equal(broken, [np.nan, 0.0, 1.0])
        np.testing.assert_array_equal(lost, np.ones(3))
        assert [sample.tracked for sample in read_log(back).samples()] == [True, True, False]

    @pytest.mark.parametrize(
        ("line", "why"),
        [
            ("x,A,head,0,0,0,0,0,0,1,1", "could not convert"),
            ("0,A,head,0,0,0,0,0,0,1", "10 columns"),
            ("0,A,nose,0,0,0,0,0,0,1,1", "nose"),
            ("0,A,head,0,0,0,0,0,0,0,1", "no rotation"),
            ("-1,A,head,0,0,0,0,0,0,1,1", "from 0 up"),
            ("0,A,head,0,0,0,0,0,0,1,yes", "instead of 0 or 1"),
        ],
    )
    def test_a_bad_line_is_named(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str, why: str
    ) -> None:
        table = tmp_path / "a.csv"
        head = "time_s,serial,role,px,py,pz,qx,qy,qz,qw,tracked"
        table.write_text(f"{head}\n0,A,head,0,0,0,0,0,0,1,1\n{line}\n", encoding="utf-8")
        assert main(["import", str(table), str(tmp_path / "a.mcap")]) == 1
        err = capsys.readouterr().err
        assert "line 3" in err and why in err
        assert not (tmp_path / "a.mcap").exists()

    def test_a_packed_table_that_is_cut_is_told(
        self, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        table, zipped = tmp_path / "a.csv", tmp_path / "a.csv.gz"
        main(["export", str(made), "--csv", str(table)])
        content = gzip.compress(table.read_bytes())
        zipped.write_bytes(content[: len(content) // 2])
        capsys.readouterr()
        assert main(["import", str(zipped), str(tmp_path / "b.mcap")]) == 1
        assert "a.csv.gz is cut short or damaged. Unpack" in capsys.readouterr().err
        assert not (tmp_path / "b.mcap").exists()

    @pytest.mark.parametrize("name", ["b.csv", "b.mcap", "missing.pcap"])
    def test_a_recording_named_last_is_not_written_over(
        self, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
    ) -> None:
        first, last = tmp_path / "a.csv", tmp_path / name
        main(["export", str(made), "--csv", str(first)])
        if name != "missing.pcap":
            last.write_bytes(first.read_bytes())
        capsys.readouterr()
        assert main(["import", str(first), str(last)]) == 1
        assert "Name the log with --output" in capsys.readouterr().err
        assert not last.exists() or last.read_bytes() == first.read_bytes()

    def test_another_file_says_what_is_known(
        self, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert main(["import", str(made), str(tmp_path / "a.mcap")]) == 1
        assert "Known is the CSV of lobstr-log export" in capsys.readouterr().err


class TestRepair:
    def test_a_cut_log_becomes_whole(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        cut, whole = tmp_path / "cut.mcap", tmp_path / "whole.mcap"
        writer = TrackerLogWriter(cut)
        with FakeDriver() as driver:
            writer.add_samples(driver.poll(1.0))
        content = cut.read_bytes()
        writer.close()
        cut.write_bytes(content[:-50])
        told = document(capsys, "repair", cut, whole)
        assert told["damage"] == "the file ends in the middle"
        assert document(capsys, "info", whole)["whole"]
        assert cut.read_bytes() == content[:-50]


def test_poses_of_the_truth_have_the_bones_of_the_user(made: Path) -> None:
    truth = read_log(made).truth
    assert truth is not None and truth.R_world is not None
    shin = np.linalg.norm(truth.p_world[:, 16] - truth.p_world[:, 15], axis=-1)
    assert np.ptp(shin) < 2e-4
    standard = np.linalg.norm(STANDARD_OFFSETS[16])
    hips_m = float(read_log(made).metadata["user"]["hips_height_m"])
    assert np.median(shin) == pytest.approx(standard * hips_m, abs=1e-3)


def test_no_command_is_wrong_use() -> None:
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 2


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM to send")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_being_stopped_ends_with_0_and_leaves_nothing(tmp_path: Path, number: int) -> None:
    table = tmp_path / "endless.csv"
    head = "time_s,serial,role,px,py,pz,qx,qy,qz,qw,tracked\n"
    table.write_text(head + "0,A,head,0,0,0,0,0,0,1,1\n" * 300_000, encoding="utf-8")
    command = [sys.executable, "-m", "lobstr_hw.runtime.commands.log", "import"]
    with subprocess.Popen(
        [*command, str(table), str(tmp_path / "a.mcap")], stderr=subprocess.PIPE, text=True
    ) as child:
        part = tmp_path / "a.mcap.part"
        while not part.exists() and child.poll() is None:
            pass
        child.send_signal(number)
        _, err = child.communicate()
    assert child.returncode == 0
    assert err == "lobstr-log import: stopped; nothing was written\n"
    assert [path.name for path in tmp_path.iterdir()] == ["endless.csv"]
