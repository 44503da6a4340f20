"""Which input of which controller stands for what: OpenXR's paths."""

from collections.abc import Iterator, Mapping

from lobstr_hw.trackers import TrackerRole

__all__ = [
    "BUTTONS",
    "HANDS",
    "TRACKERS",
    "VIVE_TRACKER_PROFILE",
    "bindings_of",
    "profiles",
    "tracker_bindings",
]

HANDS: Mapping[TrackerRole, str] = {
    TrackerRole.LEFT_HAND: "/user/hand/left",
    TrackerRole.RIGHT_HAND: "/user/hand/right",
}
TRACKERS: Mapping[TrackerRole, str] = {
    role: f"/user/vive_tracker_htcx/role/{place}"
    for role, place in {
        TrackerRole.PELVIS: "waist",
        TrackerRole.CHEST: "chest",
        TrackerRole.LEFT_FOOT: "left_foot",
        TrackerRole.RIGHT_FOOT: "right_foot",
        TrackerRole.LEFT_KNEE: "left_knee",
        TrackerRole.RIGHT_KNEE: "right_knee",
        TrackerRole.LEFT_ELBOW: "left_elbow",
        TrackerRole.RIGHT_ELBOW: "right_elbow",
    }.items()
}
"""The extension's shoulders, camera and keyboard are no roles here; it hides what is held in a
hand (cmbruns/pyopenxr_examples#4)."""

VIVE_TRACKER_PROFILE = "/interaction_profiles/htc/vive_tracker_htcx"
POSE = "input/grip/pose"
BUTTONS = ("trigger", "grip", "menu", "system", "a", "b")

BOTH = ("left", "right")
PROFILES: Mapping[str, Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "khr/simple_controller": {
        "trigger": ("select/click", BOTH),
        "menu": ("menu/click", BOTH),
    },
    "htc/vive_controller": {
        "trigger": ("trigger/click", BOTH),
        "grip": ("squeeze/click", BOTH),
        "menu": ("menu/click", BOTH),
        "system": ("system/click", BOTH),
    },
    "valve/index_controller": {
        "trigger": ("trigger/click", BOTH),
        "grip": ("squeeze/force", BOTH),
        "system": ("system/click", BOTH),
        "a": ("a/click", BOTH),
        "b": ("b/click", BOTH),
    },
    "oculus/touch_controller": {
        "trigger": ("trigger/value", BOTH),
        "grip": ("squeeze/value", BOTH),
        "menu": ("menu/click", ("left",)),
        "system": ("system/click", ("right",)),
        "a": ("a/click", ("right",)),
        "b": ("b/click", ("right",)),
    },
    "microsoft/motion_controller": {
        "trigger": ("trigger/value", BOTH),
        "grip": ("squeeze/click", BOTH),
        "menu": ("menu/click", BOTH),
    },
}
"""Button -> input and the hands that have it; an analogue input counts as pressed by the runtime's
own threshold."""

LEFT_TOUCH = {"a": "x/click", "b": "y/click"}
"""The left Touch controller calls the lower button X and the upper one Y."""


def profiles() -> Iterator[str]:
    """The paths of all controllers' interaction profiles."""
    return (f"/interaction_profiles/{name}" for name in PROFILES)


def bindings_of(profile: str) -> Iterator[tuple[str, str]]:
    """Action (``pose`` or a button) and the path bound to it, for every input of a profile."""
    name = profile.removeprefix("/interaction_profiles/")
    for hand in HANDS.values():
        yield "pose", f"{hand}/{POSE}"
    for button, (path, sides) in PROFILES[name].items():
        for side in sides:
            yield button, f"/user/hand/{side}/input/{path}"
    if name == "oculus/touch_controller":
        for button, path in LEFT_TOUCH.items():
            yield button, f"{HANDS[TrackerRole.LEFT_HAND]}/input/{path}"


def tracker_bindings() -> Iterator[tuple[str, str]]:
    """The same of the Vive trackers' profile."""
    return (("pose", f"{path}/{POSE}") for path in TRACKERS.values())
