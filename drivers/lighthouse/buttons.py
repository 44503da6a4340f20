"""The bits of buttons -> their names here: trigger, grip, menu, system, a, b.

         wand, tracker by radio    Knuckles by radio    by cable
trigger  0                         0                    0
grip     4                         -                    2
menu     5                         6                    12
system   3                         3                    13
a, b     -                         4, 5                 -

Pads and sticks are nobody's button. A Knuckles' squeeze is a force, not a button.
"""

from collections.abc import Mapping

from lobstr_hw.drivers.lighthouse.device_reader import DeviceReader

__all__ = ["held_buttons"]

WAND = {"trigger": 0, "system": 3, "grip": 4, "menu": 5}
KNUCKLES = {"trigger": 0, "system": 3, "a": 4, "b": 5, "menu": 6}
CABLE = {"trigger": 0, "grip": 2, "menu": 12, "system": 13}


def held_buttons(reader: DeviceReader, model: str) -> frozenset[str]:
    """The buttons held down, as last told.

    Args:
        reader: of the device.
        model: as the device calls itself.
    """
    by_radio = KNUCKLES if "knuckles" in model.lower() else WAND
    return _named(reader.buttons, by_radio) | _named(reader.cable_buttons, CABLE)


def _named(bits: int | None, places: Mapping[str, int]) -> frozenset[str]:
    if not bits:
        return frozenset()
    return frozenset(name for name, place in places.items() if bits >> place & 1)
