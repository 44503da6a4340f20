"""Vendor libraries: found without importing them, imported by name, missed with their cure."""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from lobstr_hw.drivers.driver import Probe
from lobstr_hw.errors import DriverUnavailable

__all__ = ["probe_library", "require_library"]


def _cure(extra: str) -> str:
    return f"pip install 'lobstr-hw[{extra}]'"


def probe_library(module: str, package: str, extra: str) -> Probe:
    """Whether ``module`` of ``package`` is installed, without importing it."""
    if find_spec(module) is not None:
        return Probe(available=True)
    return Probe(available=False, missing=f"the Python package {package}", fix=_cure(extra))


def require_library(module: str, package: str, extra: str) -> Any:
    """Import a vendor library.

    Raises:
        DriverUnavailable: it is not installed, or does not load here.
    """
    try:
        return import_module(module)
    except (ImportError, OSError) as error:  # OSError: its shared library is missing
        raise DriverUnavailable(f"{package!r} cannot be used ({error}): {_cure(extra)}") from error
