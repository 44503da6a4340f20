"""Lighthouse devices by their USB identities.

28de:2300 is the identity of trackers from 2018 on, of Knuckles and of newer headsets alike: only
the device's configuration says which of them it is.
"""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["HTC", "KNOWN", "VALVE", "DeviceKind", "KnownDevice", "kind_of"]

VALVE, HTC = 0x28DE, 0x0BB4
LIGHTHOUSE_RANGE = range(0x2000, 0x2400)
"""Product ids of Valve under which every known Lighthouse device lies."""


class DeviceKind(StrEnum):
    """What a USB identity says about a device."""

    HEADSET = "headset"
    WAND = "wand"
    TRACKER = "tracker"
    DONGLE = "dongle"  # radio: one wand, tracker or Knuckles behind each
    BY_CONFIG = "by_config"  # a tracker, Knuckles or headset: its configuration says which
    BOARD = "board"  # of a headset: power, display and proximity; it has no light sensors
    UNKNOWN = "unknown"  # looks like one of the family, but nobody has seen it


@dataclass(frozen=True, slots=True)
class KnownDevice:
    """One line of the table.

    Attributes:
        kind: what it is.
        name: for messages.
        endpoints: interrupt endpoints in, by interface.
    """

    kind: DeviceKind
    name: str
    endpoints: tuple[int, ...]


KNOWN: dict[tuple[int, int], KnownDevice] = {
    (VALVE, 0x2000): KnownDevice(DeviceKind.HEADSET, "Vive headset", (0x81, 0x82)),
    (VALVE, 0x2012): KnownDevice(DeviceKind.WAND, "Vive wand", (0x81, 0x82, 0x83)),
    (VALVE, 0x2022): KnownDevice(DeviceKind.TRACKER, "Vive Tracker 1.0", (0x81, 0x82, 0x83)),
    (VALVE, 0x2101): KnownDevice(DeviceKind.DONGLE, "Watchman dongle", (0x81,)),
    (VALVE, 0x2102): KnownDevice(DeviceKind.DONGLE, "Watchman dongle of a headset", (0x81,)),
    (VALVE, 0x2300): KnownDevice(
        DeviceKind.BY_CONFIG, "Lighthouse device (28de:2300)", (0x81, 0x83, 0x84)
    ),
    (HTC, 0x2C87): KnownDevice(DeviceKind.BOARD, "Vive main board", (0x81,)),
    (HTC, 0x0309): KnownDevice(DeviceKind.BOARD, "Vive Pro main board", (0x81,)),
    (HTC, 0x030E): KnownDevice(DeviceKind.BOARD, "Vive Pro main board", (0x81,)),
    (HTC, 0x0342): KnownDevice(DeviceKind.BOARD, "Vive Pro 2 main board", (0x81,)),
}


def kind_of(vendor_id: int, product_id: int) -> DeviceKind | None:
    """What an identity stands for; None: it is nothing of this family."""
    known = KNOWN.get((vendor_id, product_id))
    if known is not None:
        return known.kind
    if vendor_id == VALVE and product_id in LIGHTHOUSE_RANGE:
        return DeviceKind.UNKNOWN
    return None
