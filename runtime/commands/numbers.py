"""Numbers on a command line: each says what is wrong with what was typed (argparse ``type=``)."""

import argparse
from collections.abc import Callable

__all__ = ["above_zero", "between", "number", "zero_or_more"]


def number(text: str) -> float:
    """Any number."""
    try:
        return float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r} is no number") from error


def above_zero(text: str) -> float:
    """A finite number above 0."""
    value = number(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def zero_or_more(text: str) -> float:
    """A finite number of 0 or more."""
    value = number(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of 0 or more")
    return value


def between(low: float, high: float, unit: str) -> Callable[[str], float]:
    """A number within limits, both included."""

    def parse(text: str) -> float:
        value = number(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} {unit} is not between {low:g} and {high:g}")
        return value

    return parse
