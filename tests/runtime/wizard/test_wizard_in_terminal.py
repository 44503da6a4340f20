"""The real program in a pseudo-terminal, a scripted person in front of it."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from support.beds import need
from support.terminal_bed import Terminal, in_terminal

from lobstr_hw.calibration import load_profile
from lobstr_hw.trackers import FOUR_POINTS

pytestmark = pytest.mark.bed

CALIBRATE = "lobstr_hw.runtime.commands.calibrate"
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
