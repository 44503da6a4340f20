"""The real program in a pseudo-terminal, a scripted person in front of it."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from support.beds import need
from support.terminal_bed import Terminal, in_terminal

from lobstr_hw.calibration import load_profile
from lobstr_hw.drivers.fake import OTHER_SPACE, SERIALS
from lobstr_hw.trackers import FOUR_POINTS

pytestmark = pytest.mark.bed

CALIBRATE = "lobstr_hw.runtime.commands.calibrate"
LIVE = "lobstr_hw.runtime.commands.live"
BELL = "\a"


@pytest.fixture(autouse=True)
def _terminals() -> None:
    need("pseudo-terminals", "Linux or macOS", sys.platform != "win32")


def arguments(profile: Path, *more: str, driver: str = "fake:script=calibrate") -> Sequence[str]:
    return [CALIBRATE, "--driver", driver, "--no-speech", "--profile", str(profile), *more]


def shows_in_order(terminal: Terminal, *words: str) -> None:
    at = 0
    for word in words:
        found = terminal.text.find(word, at)
        assert found >= 0, f"{word!r} is not shown after {words[: words.index(word)]}"
        at = found


def test_a_person_is_led_through_it(tmp_path: Path) -> None:
    path, out = tmp_path / "me.json", tmp_path / "out.json"
    with in_terminal(arguments(path, "--json"), stdout=out) as terminal:
        assert terminal.finish(40.0) == 0, terminal.text
    shows_in_order(terminal, "1/", "Devices", "FAKE-PELVIS", "Stand still", "T-pose", "heading")
    # the heading is redrawn as often as the machine manages, the words come once
    assert "Movement" in terminal.text
    shows_in_order(terminal, "Got it", "Nod", "Bow", "Turn", "Calibration is good")
    assert BELL in terminal.text
    document = json.loads(out.read_text(encoding="utf-8"))
    assert document["profile"] == str(path)
    assert document["movement"]["missing"] == [], "a trigger press ends each part when it is done"
    assert set(load_profile(path).roles.values()) == set(FOUR_POINTS)


def test_nameless_trackers_are_told_apart_and_changed_by_number(tmp_path: Path) -> None:
    path = tmp_path / "me.json"
    with in_terminal(arguments(path, driver="fake:named=0")) as terminal:
        terminal.wait_for("Told apart")
        terminal.type("2")
        terminal.wait_for("Number 2 is right hand")
        terminal.type("222")  # pelvis, head, left hand
        terminal.wait_for("Number 2 is left hand")
        terminal.type("q")
        assert terminal.finish() == 0
    assert "nothing was written" in terminal.text
    assert not path.exists()


def test_nameless_trackers_are_calibrated_and_live_knows_them_by_serial(tmp_path: Path) -> None:
    path, out = tmp_path / "me.json", tmp_path / "live.ndjson"
    with in_terminal(arguments(path, driver="fake:script=point,named=0")) as terminal:
        assert terminal.finish(50.0) == 0, terminal.text
    shows_in_order(terminal, "Stretch both arms out", "Told apart", "T-pose", "Calibration is good")
    roles = load_profile(path).roles
    assert {role: serial for serial, role in roles.items()} == SERIALS
    live = [LIVE, "--driver", "fake:named=0", "--profile", str(path), "--output", f"ndjson:{out}"]
    with in_terminal([*live, "--duration", "1", "--no-speech"]) as terminal:
        assert terminal.finish(30.0) == 0, terminal.text
    last = json.loads(out.read_text(encoding="utf-8").splitlines()[-1])
    assert set(last["roles"].values()) == {"ok"}


@pytest.mark.parametrize("answer", ["n\r", "y\r"])
def test_an_old_profile_is_asked_about_first(tmp_path: Path, answer: str) -> None:
    path = tmp_path / "me.json"
    path.write_text("old", encoding="utf-8")
    with in_terminal(arguments(path)) as terminal:
        terminal.wait_for("Replace it? [y/N]")
        terminal.type(answer)
        if answer == "y\r":
            terminal.wait_for("Devices")
            terminal.type("\x03")
        assert terminal.finish() == (0 if answer == "y\r" else 1)
    assert path.read_text(encoding="utf-8") == "old"


def test_ctrl_c_ends_cleanly_and_gives_the_terminal_back(tmp_path: Path) -> None:
    if sys.platform == "win32":
        return
    import termios

    path = tmp_path / "me.json"
    with in_terminal(arguments(path)) as terminal:
        terminal.wait_for("Devices")
        before = termios.tcgetattr(terminal.fd)[3] & termios.ECHO
        terminal.type("\x03")
        assert terminal.finish() == 0
    assert not before, "keys are not shown while the wizard runs"
    assert "nothing was written" in terminal.text
    assert "Traceback" not in terminal.text
    assert "\x1b[?25h" in terminal.text, "the cursor is back"
    assert not path.exists()


def test_two_tracking_systems_become_one_body(tmp_path: Path) -> None:
    path, out = tmp_path / "me.json", tmp_path / "live.ndjson"

    def systems(script: str) -> list[str]:
        """Headset and controllers of one system, the belt of another, metres and turns away."""
        options = f"fake:script={script},has="
        belt = f"{options}pelvis,apart=1,name=belt,role=pelvis"
        return ["--driver", f"{options}head+left_hand+right_hand", "--driver", belt]

    command = [CALIBRATE, *systems("join"), "--no-speech", "--profile", str(path)]
    with in_terminal(command) as terminal:
        terminal.wait_for("Hold the belt tracker and one of fake firmly together")
        assert terminal.finish(90.0) == 0, terminal.text
    shows_in_order(terminal, "1/5 Join", "as one", "Joined to within", "good", "2/5 Devices")
    shows_in_order(terminal, "Calibration is good", "Tracking spaces", "the world", "mm")
    found = load_profile(path).tracking_spaces["belt"].T_world_space @ OTHER_SPACE
    assert np.linalg.norm(found.p) < 0.005
    assert np.abs(found.R - np.eye(3)).max() < 0.005

    live = [LIVE, *systems("calibrate"), "--profile", str(path), "--output", f"ndjson:{out}"]
    with in_terminal([*live, "--duration", "2", "--no-speech"]) as terminal:
        assert terminal.finish(30.0) == 0, terminal.text
    last = json.loads(out.read_text(encoding="utf-8").splitlines()[-1])
    hips, head = (np.array(last["joints"][joint][:3]) for joint in ("Hips", "Head"))
    assert hips[1] == pytest.approx(1.0, abs=0.03)
    assert np.linalg.norm((head - hips)[[0, 2]]) < 0.15, "the hips are under the head"
    assert last["roles"]["pelvis"] == "ok"
