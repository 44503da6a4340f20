"""The architecture, held to the truth: floors, packages, public names, platforms."""

import ast
import configparser
import importlib
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FLOORS = {
    "lobstr_hw": ROOT / "lobstr_hw",
    "lobstr_hw.calibration": ROOT / "calibration",
    "lobstr_hw.drivers": ROOT / "drivers",
    "lobstr_hw.runtime": ROOT / "runtime",
}
MAY_IMPORT = {
    "lobstr_hw": {"lobstr_hw"},
    "lobstr_hw.calibration": {"lobstr_hw", "lobstr_hw.calibration"},
    "lobstr_hw.drivers": {"lobstr_hw", "lobstr_hw.drivers"},
    "lobstr_hw.runtime": set(FLOORS),
}
HOME_OF_TORCH = "lobstr_hw.training"
NOT_ON_WINDOWS = ("pty", "fcntl", "termios", "resource", "pwd")


def modules() -> Iterator[tuple[str, str, Path]]:
    """Floor, module name and file of every module, without following the links."""
    for floor, folder in FLOORS.items():
        for path in sorted(folder.rglob("*.py")):
            if any(parent.is_symlink() for parent in path.parents):
                continue
            parts = path.relative_to(folder).with_suffix("").parts
            name = ".".join((floor, *parts)).removesuffix(".__init__")
            yield floor, name, path


MODULES = list(modules())


def imports_of(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module or ""


def floor_of(name: str) -> str | None:
    above = [f for f in FLOORS if f != "lobstr_hw" and (name == f or name.startswith(f + "."))]
    if above:
        return above[0]
    return "lobstr_hw" if name.split(".")[0] == "lobstr_hw" else None


@pytest.mark.parametrize(("floor", "name", "path"), MODULES, ids=[m[1] for m in MODULES])
def test_imports_go_one_way(floor: str, name: str, path: Path) -> None:
    for imported in imports_of(path):
        target = floor_of(imported)
        assert target is None or target in MAY_IMPORT[floor], f"{name} imports {imported}"
        assert imported.split(".")[0] != "torch" or name.startswith(HOME_OF_TORCH)


def test_every_package_on_disk_is_listed_in_setup_cfg() -> None:
    config = configparser.ConfigParser()
    config.read(ROOT / "setup.cfg", encoding="utf-8")
    on_disk = {name for _, name, path in MODULES if path.name == "__init__.py"}
    assert set(config["options"]["packages"].split()) == on_disk


PLAIN = [name for _, name, _ in MODULES if not name.startswith(HOME_OF_TORCH)]


@pytest.mark.parametrize("name", PLAIN)
def test_public_names_exist(name: str) -> None:
    module = importlib.import_module(name)
    missing = [n for n in getattr(module, "__all__", []) if not hasattr(module, n)]
    assert not missing, f"{name}.__all__ names {missing}"


def test_every_plain_module_imports_where_unix_modules_are_missing() -> None:
    code = (
        f"import sys, importlib; sys.modules.update(dict.fromkeys({NOT_ON_WINDOWS}));"
        f"[importlib.import_module(name) for name in {PLAIN}]"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_importing_the_ground_floor_brings_no_extras() -> None:
    code = (
        "import sys, lobstr_hw, lobstr_hw.avatar, lobstr_hw.predictors;"
        "print([m for m in ('torch', 'scipy', 'hid', 'usb', 'serial', 'openvr', 'xr', 'matplotlib')"
        " if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_no_package_is_missed_by_pkgutil() -> None:
    package = importlib.import_module("lobstr_hw")
    found = {m.name for m in pkgutil.walk_packages(package.__path__, "lobstr_hw.") if m.ispkg}
    assert {f for f in FLOORS if f != "lobstr_hw"} <= found
