"""What a test bed needs of the machine; in a build (``CI`` set) a missing bed is a failure."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

__all__ = ["environment", "need"]


def need(what: str, cure: str, present: bool) -> None:
    """Skip the test that asks, or fail it in a build, unless ``what`` is there.

    Args:
        what: the missing thing, as in "a C compiler (cc)".
        cure: the command that brings it, as in "apt-get install gcc".
        present: it is there.
    """
    if present:
        return
    message = f"this test bed needs {what}: {cure}"
    if os.environ.get("CI"):
        pytest.fail(message, pytrace=False)
    pytest.skip(message)


@contextmanager
def environment(**variables: str) -> Iterator[None]:
    """Set environment variables, for native code too, and put them back."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
