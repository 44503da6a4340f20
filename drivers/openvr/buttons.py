"""SteamVR's button numbers under the names of this project."""

from collections.abc import Mapping

__all__ = ["button_name"]

TRIGGER = 33
VIVE: Mapping[int, str] = {0: "system", 1: "menu", 2: "grip", 7: "a", TRIGGER: "trigger"}
"""The wands, trackers (their pins) and whatever is not listed below."""

OTHERS: Mapping[str, Mapping[int, str]] = {
    # without a menu button, B and A come under the numbers of the wand's menu and grip
    "knuckles": {0: "system", 1: "b", 2: "a", TRIGGER: "trigger", 34: "grip"},
    "oculus_touch": {0: "system", 1: "b", 2: "grip", 7: "a", TRIGGER: "trigger"},
}


def button_name(number: int, controller_type: str) -> str | None:
    """``trigger``, ``grip``, ``menu``, ``system``, ``a`` or ``b``; None: a stick, a touchpad."""
    return OTHERS.get(controller_type, VIVE).get(number)
