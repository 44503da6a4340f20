"""The shipped udev rules: whom they are for, and how they get into the system."""

import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from lobstr_hw.drivers.lighthouse.usb_ids import KNOWN
from lobstr_hw.drivers.polhemus import USB_IDENTITIES
from lobstr_hw.drivers.ultimate_dongle import DONGLE
from lobstr_hw.drivers.usb_permission import RULES, may_open, no_permission
from lobstr_hw.runtime.commands.devices import main
from lobstr_hw.runtime.udev_rules import install_udev_rules

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="udev is Linux's")
LINE = re.compile(
    r'^SUBSYSTEM=="(\w+)", ATTRS?\{idVendor\}=="(\w+)"(.*), MODE="0660", TAG\+="uaccess"$'
)
PRODUCTS = re.compile(r'^, ATTRS?\{idProduct\}=="([\w|]+)"$')


def let_in(subsystem: str, vendor: int, product: int) -> bool:
    """Whether a rule speaks of a device."""
    for line in RULES.read_text(encoding="utf-8").splitlines():
        rule = LINE.match(line)
        if rule and rule[1] == subsystem and int(rule[2], 16) == vendor:
            products = PRODUCTS.match(rule[3])
            if not rule[3] or (products and f"{product:04x}" in products[1].split("|")):
                return True
    return False


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str], Path]:
    """Puts a program into the only folder where commands are looked for."""
    bin_folder = tmp_path / "bin"
    bin_folder.mkdir()
    monkeypatch.setenv("PATH", f"{bin_folder}")
    monkeypatch.setenv("CALLS", str(tmp_path / "calls"))

    def put(name: str, body: str) -> Path:
        program = bin_folder / name
        program.write_text(f'#!/bin/sh\necho "{name} $*" >> "$CALLS"\n{body}\n', encoding="utf-8")
        program.chmod(0o755)
        return program

    return put


def test_every_device_on_usb_that_a_driver_knows_has_a_rule() -> None:
    for vendor, product in [*KNOWN, DONGLE]:
        assert let_in("hidraw", vendor, product), f"{vendor:04x}:{product:04x}"
        assert let_in("usb", vendor, product), f"{vendor:04x}:{product:04x}"
    for identities in USB_IDENTITIES.values():
        for vendor, product in identities:
            assert let_in("usb", vendor, product), f"{vendor:04x}:{product:04x}"
    assert not let_in("usb", 0x1D6B, 0x0002), "a hub is nobody's business"


def test_the_rules_sort_before_those_that_act_on_their_tag() -> None:
    assert RULES.name < "73-seat-late.rules"


@linux_only
def test_a_permission_error_names_the_command_that_there_is(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = "--install-udev-rules"
    assert f"lobstr-devices {command}" in str(no_permission("the thing"))
    with pytest.raises(SystemExit):
        main(["--help"])
    assert command in capsys.readouterr().out


@linux_only
def test_the_rules_are_installed_and_used(
    shell: Callable[[str, str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shell("sudo", 'exec "$@"')
    shell("udevadm", "")
    shell("install", 'exec /usr/bin/install "$@"')
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    folder, told = tmp_path / "etc" / "rules.d", list[str]()
    assert install_udev_rules(told.append, folder) == 0
    place = folder / RULES.name
    assert place.read_bytes() == RULES.read_bytes()
    assert place.stat().st_mode & 0o777 == 0o644
    calls = (tmp_path / "calls").read_text(encoding="utf-8").splitlines()
    assert [call for call in calls if call.startswith("udevadm")] == [
        "udevadm control --reload",
        "udevadm trigger --subsystem-match=usb --subsystem-match=hidraw",
    ]
    assert sum(call.startswith("sudo") for call in calls) == 3
    assert "plug them in again" in told[-1]


@linux_only
def test_what_fails_is_told_and_ends_it(
    shell: Callable[[str, str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shell("sudo", 'exec "$@"')
    shell("install", "exit 3")
    shell("udevadm", "")
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    told = list[str]()
    assert install_udev_rules(told.append, tmp_path / "etc") == 1
    assert "exit code 3" in told[-1]
    assert "udevadm" not in (tmp_path / "calls").read_text(encoding="utf-8")


@linux_only
def test_without_sudo_the_commands_are_told(
    shell: Callable[[str, str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    told = list[str]()
    assert install_udev_rules(told.append) == 1
    assert str(RULES) in told[-1]
    assert "udevadm control --reload" in told[-1]


@linux_only
def test_root_needs_no_sudo_and_a_missing_program_is_told(
    shell: Callable[[str, str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shell("install", "")
    monkeypatch.setattr("os.geteuid", lambda: 0)
    told = list[str]()
    assert install_udev_rules(told.append, tmp_path / "etc") == 1
    assert told[-1].startswith("udevadm cannot be run")


@linux_only
def test_a_device_file_lets_in_whom_its_mode_says(tmp_path: Path) -> None:
    node = tmp_path / "node"
    assert may_open(node), "what is not there is no matter of permission"
    node.touch()
    assert may_open(node)
    node.chmod(0)
    if sys.platform != "win32" and os.geteuid() != 0:
        assert not may_open(node)
