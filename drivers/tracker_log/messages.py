"""Messages of a tracker log: encoding and decoding, apart from the file around them.

Positions keep 1e-6 m, quaternions 1e-7, times 1 ns. JSON has no NaN: a number that is not finite is
written as null and read as NaN, so a replay hands on the broken sample that the device gave. A
tracker without a position (an IMU) has no ``position`` at all.
"""

import base64
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.tracker_log.schemas import WORLD_FRAME
from lobstr_hw.rotations import Array, to_quat_xyzw, transpose
from lobstr_hw.skeleton import HUMANOID_NAMES, PARENTS, global_rotations
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerRole, TrackerSample, TrackingState

__all__ = [
    "DeviceState",
    "PoseReading",
    "SkeletonReading",
    "TruthReading",
    "event_message",
    "nanoseconds",
    "pose_message",
    "read_event",
    "read_pose",
    "read_skeleton",
    "read_state",
    "read_truth",
    "seconds",
    "skeleton_message",
    "state_message",
    "truth_message",
]

QUATERNION_STEPS = 32767.0
TRUTH_STEPS_PER_M = 2.0**14
"""Truth is rounded to 0.03 mm: the zeros at the end of each float make the file a third smaller."""


@dataclass(frozen=True, slots=True)
class DeviceState:
    """What holds for a tracker until its next state message.

    Attributes:
        role: the body part, where it is known.
        tracked: the device sees itself.
        state: how it comes by its pose.
        battery: 0 to 1, or None.
        buttons: those held down.
    """

    role: TrackerRole | None = None
    tracked: bool = True
    state: TrackingState = TrackingState.OK
    battery: float | None = None
    buttons: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PoseReading:
    """One pose message: position or None, quaternion x, y, z, w, and what else the device said."""

    p: tuple[float, ...] | None
    quat_xyzw: tuple[float, ...]
    velocity: tuple[float, ...] | None = None
    covariance: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonReading:
    """One skeleton message: translations (22, 3) and quaternions (22, 4) in the parent."""

    p_local: Array
    quat_xyzw: Array
    contact: tuple[bool, ...]
    roles: dict[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class TruthReading:
    """One truth message: joints (22, 3), and quaternions (22, 4) in steps, as they are stored."""

    p_world: npt.NDArray[np.float32]
    quat_steps: npt.NDArray[np.int16] | None


def nanoseconds(time_s: float) -> int:
    """Whole nanoseconds, rounded down.

    Down, so that a sample of a tick's own time is not newer than the tick. The 0.05 makes reading
    back and writing again exact.
    """
    if not time_s >= 0.0:
        raise ValueError(f"a log cannot hold the time {time_s} s: times start at 0")
    return math.floor(time_s * 1e9 + 0.05)


def seconds(time_ns: int) -> float:
    """The inverse of :func:`nanoseconds`."""
    return time_ns / 1e9


def _stamp(time_ns: int) -> str:
    whole_s, rest_ns = divmod(time_ns, 1_000_000_000)
    return f'{{"sec":{whole_s},"nsec":{rest_ns}}}'


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "null"


def _named(names: str, values: Iterable[float], digits: int) -> str:
    pairs = (f'"{n}":{_number(v, digits)}' for n, v in zip(names, values, strict=True))
    return "{" + ",".join(pairs) + "}"


def _listed(values: Array) -> str:
    return "[" + ",".join(f"{v:.9g}" if math.isfinite(v) else "null" for v in values.ravel()) + "]"


def pose_message(time_ns: int, sample: TrackerSample, quat_xyzw: Sequence[float]) -> bytes:
    """A ``foxglove.PoseInFrame``; the rotation comes as a quaternion, converted in batches above.

    ``velocity`` and ``covariance`` stand beside the published fields where the device knows them.
    """
    p = sample.T_world_tracker.p
    position = "" if p is None else f'"position":{_named("xyz", p.tolist(), 6)},'
    extra = ""
    if sample.velocity is not None:
        extra += f',"velocity":{_listed(sample.velocity)}'
    if sample.covariance is not None:
        extra += f',"covariance":{_listed(sample.covariance)}'
    text = (
        f'{{"timestamp":{_stamp(time_ns)},"frame_id":"{WORLD_FRAME}","pose":{{{position}'
        f'"orientation":{_named("xyzw", quat_xyzw, 7)}}}{extra}}}'
    )
    return text.encode()


def read_pose(data: bytes) -> PoseReading:
    """The inverse of :func:`pose_message`, for poses of other writers too."""
    message = json.loads(data)
    pose = message["pose"]
    return PoseReading(
        None if pose.get("position") is None else _floats(pose["position"], "xyz"),
        _floats(pose["orientation"], "xyzw"),
        _maybe_floats(message.get("velocity")),
        _maybe_floats(message.get("covariance")),
    )


def _floats(values: dict[str, Any], names: str) -> tuple[float, ...]:
    return tuple(math.nan if values[n] is None else float(values[n]) for n in names)


def _maybe_floats(values: list[Any] | None) -> tuple[float, ...] | None:
    if values is None:
        return None
    return tuple(math.nan if v is None else float(v) for v in values)


def state_message(time_ns: int, device: DeviceState) -> bytes:
    """A ``lobstr.TrackerState``."""
    return _stamped(
        time_ns,
        role=device.role,
        tracked=device.tracked,
        state=device.state,
        battery=device.battery,
        buttons=device.buttons,
    )


def read_state(data: bytes) -> DeviceState:
    """The inverse of :func:`state_message`."""
    message = json.loads(data)
    role = message.get("role")
    return DeviceState(
        None if role is None else TrackerRole(role),
        bool(message.get("tracked", True)),
        TrackingState(message.get("state", TrackingState.OK)),
        message.get("battery"),
        tuple(message.get("buttons") or ()),
    )


def event_message(time_ns: int, event: DeviceEvent) -> bytes:
    """A ``lobstr.Event``."""
    return _stamped(time_ns, kind=event.kind, serial=event.serial, name=event.name)


def _stamped(time_ns: int, **fields: object) -> bytes:
    whole_s, rest_ns = divmod(time_ns, 1_000_000_000)
    message = {"timestamp": {"sec": whole_s, "nsec": rest_ns}, **fields}
    return json.dumps(message, separators=(",", ":")).encode()


def read_event(time_s: float, data: bytes) -> DeviceEvent | None:
    """The inverse of :func:`event_message`; None for a kind that is not known here."""
    message = json.loads(data)
    if message["kind"] not in set(EventKind):
        return None
    kind = EventKind(message["kind"])
    return DeviceEvent(kind, message.get("serial", ""), time_s, message.get("name", ""))


def skeleton_message(time_ns: int, pose: SkeletonPose) -> bytes:
    """A ``foxglove.FrameTransforms``: each joint in its parent, the hips in the world.

    Raises:
        ValueError: when the pose holds more than one person.
    """
    if len(pose.p_world) != 1:
        raise ValueError(f"a log holds one skeleton, got {len(pose.p_world)}")
    q = to_quat_xyzw(pose.R_local[0])
    p = _translations(pose.p_world[0], pose.R_local[0])
    stamp, names = _stamp(time_ns), (WORLD_FRAME, *HUMANOID_NAMES)
    transforms = ",".join(
        f'{{"timestamp":{stamp},"parent_frame_id":"{names[parent + 1]}",'
        f'"child_frame_id":"{child}","translation":{_named("xyz", p_j, 6)},'
        f'"rotation":{_named("xyzw", q_j, 7)}}}'
        for child, parent, p_j, q_j in zip(
            HUMANOID_NAMES, PARENTS, p.tolist(), q.tolist(), strict=True
        )
    )
    contact = json.dumps([bool(c) for c in pose.contact[0]])
    roles = json.dumps({role: report.state for role, report in pose.roles.items()})
    return f'{{"transforms":[{transforms}],"contact":{contact},"roles":{roles}}}'.encode()


def _translations(p_world: Array, R_local: Array) -> Array:
    R_parent = global_rotations(R_local)[list(PARENTS[1:])]
    bones = p_world[1:] - p_world[list(PARENTS[1:])]
    return np.concatenate([p_world[:1], (transpose(R_parent) @ bones[..., None])[..., 0]])


def read_skeleton(data: bytes) -> SkeletonReading:
    """The inverse of :func:`skeleton_message`."""
    message = json.loads(data)
    by_name = {t["child_frame_id"]: t for t in message["transforms"]}
    transforms = [by_name[name] for name in HUMANOID_NAMES]
    return SkeletonReading(
        np.array([_floats(t["translation"], "xyz") for t in transforms]),
        np.array([_floats(t["rotation"], "xyzw") for t in transforms]),
        tuple(message.get("contact", ())),
        dict(message.get("roles", {})),
    )


def truth_message(time_ns: int, p_world: Array, R_world: Array | None) -> bytes:
    """A ``lobstr.Truth``: world joints (22, 3) and, where known, their rotations (22, 3, 3)."""
    rotations = ""
    if R_world is not None:
        q = np.rint(to_quat_xyzw(R_world) * QUATERNION_STEPS).astype("<i2")
        rotations = f',"quat_xyzw":"{base64.b64encode(q.tobytes()).decode()}"'
    rounded = np.rint(np.asarray(p_world) * TRUTH_STEPS_PER_M) / TRUTH_STEPS_PER_M
    p = base64.b64encode(rounded.astype("<f4").tobytes()).decode()
    return f'{{"timestamp":{_stamp(time_ns)},"p_world":"{p}"{rotations}}}'.encode()


def read_truth(data: bytes) -> TruthReading:
    """The inverse of :func:`truth_message`."""
    message = json.loads(data)
    p = np.frombuffer(base64.b64decode(message["p_world"]), "<f4").reshape(22, 3)
    if "quat_xyzw" not in message:
        return TruthReading(p, None)
    q = np.frombuffer(base64.b64decode(message["quat_xyzw"]), "<i2").reshape(22, 4)
    return TruthReading(p, q)
