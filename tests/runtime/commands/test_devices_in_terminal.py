"""What a person sees of lobstr-devices and lobstr-record, in a pseudo-terminal."""

import os
import signal
from pathlib import Path

import pytest
from support.terminal_bed import in_terminal

from lobstr_hw.drivers.tracker_log import read_log

pytestmark = [
    pytest.mark.bed,
    pytest.mark.skipif(os.name == "nt", reason="Windows has no pseudo-terminals"),
]


def test_watching_shows_the_devices_until_ctrl_c() -> None:
    with in_terminal(["lobstr_hw.runtime.commands.devices", "--watch"]) as terminal:
        terminal.wait_for("FAKE-PELVIS")
        terminal.process.send_signal(signal.SIGINT)
        assert terminal.finish() == 0
    assert "Traceback" not in terminal.text


def test_recording_shows_rates_and_the_disk_until_ctrl_c(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    command = ["lobstr_hw.runtime.commands.record", str(path), "--driver", "fake"]
    with in_terminal(command) as terminal:
        for words in ("recording", "free", "FAKE-PELVIS", "Hz", "drop-outs 0"):
            terminal.wait_for(words)
        terminal.process.send_signal(signal.SIGINT)
        assert terminal.finish() == 0
    assert "lobstr-live --sim" in terminal.text
    assert not read_log(path).cut
