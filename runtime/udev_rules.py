"""Putting the shipped udev rules where Linux looks for them: once, as root, by sudo."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from shutil import which

from lobstr_hw.drivers.usb_permission import RULES

__all__ = ["install_udev_rules"]

FOLDER = Path("/etc/udev/rules.d")


def install_udev_rules(tell: Callable[[str], None], folder: Path = FOLDER) -> int:
    """Install the rules and have them used at once; returns the exit code of a command line.

    Args:
        tell: takes what is done, command by command, and what went wrong.
        folder: of the system's rules.
    """
    if sys.platform != "linux":
        tell("udev rules are for Linux; here devices need none.")
        return 2
    commands = _commands(folder / RULES.name)
    if os.geteuid() != 0:
        if which("sudo") is None:
            told = "\n".join(f"  {' '.join(command)}" for command in commands)
            tell(f"sudo is not here; run these commands as root:\n{told}")
            return 1
        commands = [["sudo", *command] for command in commands]
    for command in commands:
        if not _ran(command, tell):
            return 1
    tell("done: unplug the devices and plug them in again.")
    return 0


def _commands(place: Path) -> list[list[str]]:
    return [
        ["install", "-D", "-m", "644", str(RULES), str(place)],
        ["udevadm", "control", "--reload"],
        ["udevadm", "trigger", "--subsystem-match=usb", "--subsystem-match=hidraw"],
    ]


def _ran(command: Sequence[str], tell: Callable[[str], None]) -> bool:
    tell(" ".join(command))
    try:
        code = subprocess.run(command, check=False).returncode
    except OSError as error:
        tell(f"{command[0]} cannot be run: {error.strerror}.")
        return False
    if code:
        tell(f"that failed with exit code {code}; nothing further was done.")
    return code == 0
