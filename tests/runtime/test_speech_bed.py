"""A real voice, its sound written to files: espeak-ng says what the program wants said."""

import shutil
import stat
import sys
import wave
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.beds import need
from support.terminal_bed import in_terminal
from support.two_fakes import two_fakes

from lobstr_hw.runtime.announcer import LONGEST_S, Announcer, Spoken
from lobstr_hw.runtime.one_space import spaces_apart
from lobstr_hw.runtime.speech import SpeechEngine, find_speech
from lobstr_hw.runtime.wizard.flow import Wizard
from lobstr_hw.runtime.wizard.plan import steps_for_a_person, steps_to_join
from lobstr_hw.runtime.wizard.stage import Person

pytestmark = pytest.mark.bed

VOICE = "espeak-ng"


@pytest.fixture(autouse=True)
def _voice() -> None:
    need("a voice (espeak-ng)", "apt-get install espeak-ng", shutil.which(VOICE) is not None)


def into(path: Path) -> SpeechEngine:
    """The program's own engine, but for where the sound goes."""
    engine = SpeechEngine(VOICE, (VOICE, "--"))
    assert find_speech("linux") is not None
    return replace(engine, command=(VOICE, "-w", str(path), *engine.command[1:]))


def sound(path: Path) -> tuple[float, float]:
    """Seconds, and how loud (0 to 1)."""
    with wave.open(str(path)) as file:
        data = np.frombuffer(file.readframes(file.getnframes()), dtype=np.int16)
        return len(data) / file.getframerate(), float(np.abs(data).max()) / 32768.0


def said(text: str, folder: Path) -> float:
    """Seconds that the voice takes for a text."""
    path = folder / "said.wav"
    with into(path).start(text) as process:
        assert process.wait(20.0) == 0
    seconds, loudness = sound(path)
    assert loudness > 0.05, text
    return seconds


def test_the_voice_is_the_one_that_the_program_would_take(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only = tmp_path / VOICE
    only.write_text("#!/bin/sh\n", encoding="utf-8")
    only.chmod(only.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(tmp_path))
    found = find_speech("linux")
    assert found == SpeechEngine(VOICE, (VOICE, "--"))


def test_an_announcer_speaks_with_it(tmp_path: Path) -> None:
    path = tmp_path / "said.wav"
    with Announcer(engine=into(path)) as announcer:
        announcer.say(Spoken("Now a T pose. Arms straight out to the sides, and hold."))
    seconds, loudness = sound(path)
    assert 1.5 < seconds < LONGEST_S
    assert loudness > 0.05


@pytest.mark.parametrize("text", ["-v nothing", "--help", "$(reboot)", "<break time='9s'/>"])
def test_whatever_is_to_be_said_is_said_and_not_obeyed(text: str, tmp_path: Path) -> None:
    assert 0.3 < said(text, tmp_path) < 5.0


def sentences() -> Sequence[str]:
    """All that somebody with two tracking systems hears, as it is spoken: one turn, one breath."""
    with two_fakes() as driver:
        world = spaces_apart(driver)
        assert world is not None
        wizard = Wizard(Person(), [*steps_to_join(world), *steps_for_a_person()])
        heard, now_s = [], 0.0
        while not wizard.done and now_s < 60.0:
            now_s += 1.0 / 30.0
            turn = wizard.add(now_s, world.poll(now_s), world.events(), world.devices())
            heard.append(" ".join(spoken.text for spoken in turn))
    assert wizard.done
    return [words for words in heard if words]


def test_no_sentence_of_the_wizard_is_cut_off(tmp_path: Path) -> None:
    heard = sentences()
    assert len(heard) >= 8
    for words in heard:
        assert said(words, tmp_path) < LONGEST_S, words


def test_the_real_program_speaks(tmp_path: Path) -> None:
    need("pseudo-terminals", "Linux or macOS", sys.platform != "win32")
    sounds, shim = tmp_path / "sounds", tmp_path / "bin" / VOICE
    for folder in (sounds, shim.parent):
        folder.mkdir()
    real = shutil.which(VOICE)
    shim.write_text(f'#!/bin/sh\nexec {real} -w "{sounds}/$$.wav" "$@"\n', encoding="utf-8")
    shim.chmod(shim.stat().st_mode | stat.S_IXUSR)
    module = "lobstr_hw.runtime.commands.calibrate"
    profile = ["--profile", str(tmp_path / "me.json")]
    command = [module, "--driver", "fake:script=calibrate", *profile]
    with in_terminal(command, environment={"PATH": str(shim.parent)}) as terminal:
        assert terminal.finish(60.0) == 0, terminal.text
    spoken = [sound(path) for path in sounds.iterdir()]
    assert len(spoken) >= 6
    assert min(seconds for seconds, _ in spoken) > 0.3
    assert min(loudness for _, loudness in spoken) > 0.05
