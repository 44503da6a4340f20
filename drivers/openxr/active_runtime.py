"""Which OpenXR runtime is the active one: the loader's own search, without loading anything."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

__all__ = ["active_runtime"]

OVERRIDE = "XR_RUNTIME_JSON"
REGISTRY_KEY = r"SOFTWARE\Khronos\OpenXR\1"
MANIFESTS = "openxr/1/active_runtime*.json"
"""Newer loaders look for one with the processor in its name first."""


def active_runtime() -> Path | None:
    """The manifest of the active runtime; None: there is none."""
    chosen = os.environ.get(OVERRIDE)
    candidates = [Path(chosen)] if chosen else _registered()
    return next((path for path in candidates if path.is_file()), None)


def _registered() -> Iterator[Path]:
    if sys.platform == "win32":
        import winreg

        try:
            with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, REGISTRY_KEY) as key:
                yield Path(str(winreg.QueryValueEx(key, "ActiveRuntime")[0]))
        except OSError:
            return
    else:
        for folder in _config_folders():
            yield from sorted(folder.glob(MANIFESTS))


def _config_folders() -> Iterator[Path]:
    """The XDG base directories, then what the loader was built with."""
    home = os.environ.get("XDG_CONFIG_HOME")
    yield Path(home) if home else Path.home() / ".config"
    shared = os.environ.get("XDG_CONFIG_DIRS") or "/etc/xdg"
    yield from (Path(folder) for folder in shared.split(":") if folder)
    yield Path("/etc")
