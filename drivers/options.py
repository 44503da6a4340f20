"""Kinds of values in a driver's spec (``NAME:key=value``) that Python has no type for."""

__all__ = ["yes_no"]


def yes_no(text: str) -> bool:
    """``yes`` or ``no``.

    Raises:
        ValueError: anything else.
    """
    if text not in ("yes", "no"):
        raise ValueError(f"{text!r} is neither yes nor no")
    return text == "yes"
