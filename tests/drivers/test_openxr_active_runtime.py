"""Finding the active OpenXR runtime without loading it."""

import sys
from pathlib import Path

import pytest

from lobstr_hw.drivers import driver_class
from lobstr_hw.drivers.driver import Probe
from lobstr_hw.drivers.openxr import driver as driver_module
from lobstr_hw.drivers.openxr.active_runtime import active_runtime

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the registry tells there")


@pytest.fixture(autouse=True)
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("XR_RUNTIME_JSON", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CONFIG_DIRS", f"{tmp_path / 'first'}:{tmp_path / 'second'}")


def manifest(folder: Path, name: str = "active_runtime.json") -> Path:
    path = folder / "openxr" / "1" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("{}", encoding="utf-8")
    return path


def test_the_users_runtime_goes_before_the_systems(tmp_path: Path) -> None:
    second = manifest(tmp_path / "second")
    assert active_runtime() == second
    first = manifest(tmp_path / "first")
    assert active_runtime() == first
    home = manifest(tmp_path / "home")
    assert active_runtime() == home


def test_a_manifest_may_name_its_processor(tmp_path: Path) -> None:
    path = manifest(tmp_path / "home", "active_runtime.x86_64.json")
    assert active_runtime() == path


def test_the_environment_overrules_everything(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    manifest(tmp_path / "home")
    chosen = manifest(tmp_path / "chosen")
    monkeypatch.setenv("XR_RUNTIME_JSON", str(chosen))
    assert active_runtime() == chosen
    monkeypatch.setenv("XR_RUNTIME_JSON", str(tmp_path / "missing"))
    assert active_runtime() is None


def test_a_manifest_that_leads_nowhere_is_none(tmp_path: Path) -> None:
    path = manifest(tmp_path / "home")
    path.unlink()
    path.symlink_to(tmp_path / "a runtime that was removed")
    manifest_of_system = manifest(tmp_path / "first")
    assert active_runtime() == manifest_of_system


def test_probing_without_a_runtime_says_how_to_get_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver_module, "probe_library", lambda *_: Probe(available=True))
    monkeypatch.setattr(driver_module, "active_runtime", lambda: None)
    probe = driver_class("openxr").probe()
    assert not probe.available
    assert "set as active runtime" in probe.fix
