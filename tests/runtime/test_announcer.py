"""Bells and voices: at once for whoever calls, newest words first, no engine no harm."""

import io
import sys
from pathlib import Path

import pytest
from support.waiting import wait_until

from lobstr_hw.runtime.announcer import BELLS, Announcer, Sound, Spoken
from lobstr_hw.runtime.speech import TEXT_VARIABLE, SpeechEngine, find_speech


def engine(path: Path) -> SpeechEngine:
    """A voice that writes down what it says."""
    code = (
        f"import os; f = open({str(path)!r}, 'a', encoding='utf-8'); "
        f"f.write(os.environ[{TEXT_VARIABLE!r}] + '\\n')"
    )
    return SpeechEngine("python", (sys.executable, "-S", "-c", code), by_variable=True)


@pytest.mark.parametrize("sound", Sound)
def test_each_sound_has_its_number_of_bells(sound: Sound) -> None:
    bell = io.StringIO()
    with Announcer(speech=False, bell=bell) as announcer:
        announcer.say(Spoken("Hello.", sound))
    assert bell.getvalue() == "\a" * BELLS[sound]


def test_a_voice_says_the_words_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "said.txt"
    text = "It's 5 o'clock; $(rm -rf) `x` \"quoted\" & more."
    with Announcer(bell=io.StringIO(), engine=engine(path)) as announcer:
        announcer.say(Spoken(text))
    assert path.read_text(encoding="utf-8") == text + "\n"


def test_words_that_come_late_are_left_out_but_not_their_bells(tmp_path: Path) -> None:
    path, bell = tmp_path / "said.txt", io.StringIO()
    with Announcer(bell=bell, engine=engine(path)) as announcer:
        announcer.say(Spoken("first"))
        wait_until(lambda: bell.getvalue() == "\a", "the first bell")
        for word in ("second", "third", "last"):
            announcer.say(Spoken(word))
    said = path.read_text(encoding="utf-8").split()
    assert said[0] == "first"
    assert said[-1] == "last"
    assert len(said) <= 3
    assert bell.getvalue() == "\a" * 4


def test_a_voice_that_cannot_be_started_leaves_the_bells() -> None:
    bell = io.StringIO()
    none = SpeechEngine("none", ("no-such-program-anywhere",))
    with Announcer(bell=bell, engine=none) as announcer:
        announcer.say(Spoken("one"))
        wait_until(lambda: bell.getvalue() == "\a", "the first bell")
        announcer.say(Spoken("two"))
    assert bell.getvalue() == "\a\a"


def test_a_terminal_that_went_away_is_no_error() -> None:
    bell = io.StringIO()
    bell.close()
    with Announcer(speech=False, bell=bell) as announcer:
        announcer.say(Spoken("Hello."))


@pytest.mark.parametrize(
    ("platform", "program"),
    [("darwin", "say"), ("win32", "powershell"), ("linux", "spd-say"), ("linux", "espeak-ng")],
)
def test_every_system_has_its_voice(
    platform: str, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shutil.which", lambda name: name if name == program else None)
    found = find_speech(platform)
    assert found is not None
    assert found.command[0] == program
    assert found.by_variable == (platform == "win32")


def test_a_silent_system_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert find_speech() is None
