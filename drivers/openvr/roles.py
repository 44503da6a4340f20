"""What SteamVR's words for roles mean here."""

from dataclasses import dataclass

from lobstr_hw.trackers import TrackerRole

__all__ = ["HEADSET", "Facts", "device_kind", "said_role"]

HEADSET, CONTROLLER, TRACKER, BASE_STATION = 1, 2, 3, 4
"""SteamVR's device classes that matter here."""

KINDS = {
    HEADSET: "headset",
    CONTROLLER: "controller",
    TRACKER: "tracker",
    BASE_STATION: "base_station",
}
HANDS = {1: TrackerRole.LEFT_HAND, 2: TrackerRole.RIGHT_HAND}
"""SteamVR's controller roles; 3 and up (opt-out, treadmill, stylus) are nobody's hand."""

PLACES = {
    "waist": TrackerRole.PELVIS,
    "chest": TrackerRole.CHEST,
    "left_foot": TrackerRole.LEFT_FOOT,
    "right_foot": TrackerRole.RIGHT_FOOT,
    "left_knee": TrackerRole.LEFT_KNEE,
    "right_knee": TrackerRole.RIGHT_KNEE,
    "left_elbow": TrackerRole.LEFT_ELBOW,
    "right_elbow": TrackerRole.RIGHT_ELBOW,
}
"""Where "Manage Trackers" can put one; shoulders, camera, keyboard are no roles here."""

TRACKER_TYPE = "vive_tracker"
"""How the controller types of trackers begin, whatever class SteamVR shows them under."""

SETTINGS = {f"TrackerRole_{place.title().replace('_', '')}": place for place in PLACES}


@dataclass(frozen=True, slots=True)
class Facts:
    """What SteamVR says of one device that bears on its role."""

    serial: str
    device_class: int
    hand: int
    controller_type: str
    setting: str
    """The user's choice in "Manage Trackers", as in ``TrackerRole_Waist``; empty: none."""


def device_kind(facts: Facts) -> str:
    """``headset``, ``controller``, ``tracker`` or ``base_station``.

    A tracker set to "held in hand" shows up among the controllers (ValveSoftware/openvr#1680).
    """
    if facts.controller_type.startswith(TRACKER_TYPE):
        return KINDS[TRACKER]
    return KINDS.get(facts.device_class, "")


def said_role(facts: Facts) -> TrackerRole | None:
    """What SteamVR says a device stands for: by the user's setting, else by its type."""
    if facts.device_class == HEADSET:
        return TrackerRole.HEAD
    if facts.device_class == CONTROLLER:
        return HANDS.get(facts.hand)
    # a hand role of any other class means nothing: a wireless adapter poses as a tracker in the
    # left hand (GodotVR/godot_openvr#68)
    place = SETTINGS.get(facts.setting)
    return PLACES.get(place or facts.controller_type.removeprefix(f"{TRACKER_TYPE}_"))
