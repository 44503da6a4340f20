"""Waiting for another thread: by condition, with an end, and no longer than needed."""

import time
from collections.abc import Callable

import pytest

__all__ = ["wait_until"]


def wait_until(condition: Callable[[], bool], what: str, within_s: float = 5.0) -> None:
    """Return as soon as ``condition`` holds; fail when it does not in time."""
    end = time.perf_counter() + within_s
    while not condition():
        if time.perf_counter() > end:
            pytest.fail(f"not within {within_s} s: {what}")
        time.sleep(0.001)
