"""Topics and JSON schemas of a tracker log.

``foxglove.*`` are the published schema names and fields of Foxglove, whose 3D panel knows what to
draw by them and ignores keys that it does not know. Rerun (0.41) opens the file and lists these
messages, but draws only protobuf. ``lobstr.*`` are this project's own.
"""

import json
from typing import Any

__all__ = [
    "EVENT",
    "EVENTS_TOPIC",
    "FRAME_TRANSFORMS",
    "POSE_IN_FRAME",
    "SCHEMAS",
    "SKELETON_TOPIC",
    "TRACKERS_PREFIX",
    "TRACKER_STATE",
    "TRUTH",
    "TRUTH_TOPIC",
    "WORLD_FRAME",
    "pose_topic",
    "schema_text",
    "serial_of_topic",
    "state_topic",
]

POSE_IN_FRAME = "foxglove.PoseInFrame"
FRAME_TRANSFORMS = "foxglove.FrameTransforms"
TRACKER_STATE = "lobstr.TrackerState"
TRUTH = "lobstr.Truth"
EVENT = "lobstr.Event"

TRACKERS_PREFIX = "/trackers/"
STATE_SUFFIX = "/state"
SKELETON_TOPIC = "/skeleton"
TRUTH_TOPIC = "/truth"
EVENTS_TOPIC = "/events"
WORLD_FRAME = "world"
"""Name of the tracking space: right-handed, +Y up, metres (docs/conventions.md)."""


def pose_topic(serial: str) -> str:
    """Where the poses of a tracker go."""
    return TRACKERS_PREFIX + serial


def state_topic(serial: str) -> str:
    """Where the states of a tracker go."""
    return TRACKERS_PREFIX + serial + STATE_SUFFIX


def serial_of_topic(topic: str) -> str | None:
    """The serial a pose or state topic is about; None for topics of something else."""
    if not topic.startswith(TRACKERS_PREFIX):
        return None
    return topic.removeprefix(TRACKERS_PREFIX).removesuffix(STATE_SUFFIX)


def _object(title: str, /, **properties: Any) -> dict[str, Any]:
    return {"title": title, "type": "object", "properties": properties}


def _numbers(title: str, names: str) -> dict[str, Any]:
    return _object(title, **{name: {"type": "number"} for name in names})


_STRING = {"type": "string"}
_BASE64 = {"type": "string", "contentEncoding": "base64"}
_TIME = _object(
    "time",
    sec={"type": "integer", "minimum": 0},
    nsec={"type": "integer", "minimum": 0, "maximum": 999_999_999},
)
_POSE = _object(
    "foxglove.Pose",
    position=_numbers("foxglove.Vector3", "xyz"),
    orientation=_numbers("foxglove.Quaternion", "xyzw"),
)
_TRANSFORM = _object(
    "foxglove.FrameTransform",
    timestamp=_TIME,
    parent_frame_id=_STRING,
    child_frame_id=_STRING,
    translation=_numbers("foxglove.Vector3", "xyz"),
    rotation=_numbers("foxglove.Quaternion", "xyzw"),
)

SCHEMAS: dict[str, dict[str, Any]] = {
    POSE_IN_FRAME: _object(
        POSE_IN_FRAME,
        timestamp=_TIME,
        frame_id=_STRING,
        pose=_POSE,
        velocity={"type": "array", "items": {"type": "number"}, "description": "m/s; ours"},
        covariance={"type": "array", "items": {"type": "number"}, "description": "6x6; ours"},
    ),
    FRAME_TRANSFORMS: _object(
        FRAME_TRANSFORMS,
        transforms={"type": "array", "items": _TRANSFORM},
        contact={"type": "array", "items": {"type": "boolean"}, "description": "left, right; ours"},
        roles={"type": "object", "description": "role: how it fares; ours"},
    ),
    TRACKER_STATE: _object(
        TRACKER_STATE,
        timestamp=_TIME,
        role=_STRING,
        tracked={"type": "boolean"},
        state=_STRING,
        battery={"type": "number", "minimum": 0, "maximum": 1},
        buttons={"type": "array", "items": _STRING, "description": "those held down"},
    ),
    EVENT: _object(
        EVENT,
        timestamp=_TIME,
        kind=_STRING | {"description": "recentred, or command"},
        serial=_STRING | {"description": "empty: of no single device"},
        name=_STRING | {"description": "of the command"},
    ),
    TRUTH: _object(
        TRUTH,
        timestamp=_TIME,
        p_world=_BASE64 | {"description": "float32 little-endian (22, 3), metres"},
        quat_xyzw=_BASE64
        | {"description": "int16 little-endian (22, 4), world rotations times 32767"},
    ),
}


def schema_text(name: str) -> bytes:
    """A schema as it stands in the file."""
    return json.dumps(SCHEMAS[name], separators=(",", ":")).encode()
