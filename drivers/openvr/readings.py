"""SteamVR's pose records as samples."""

import ctypes
from typing import Any

import numpy as np
import numpy.typing as npt

from lobstr_hw.errors import DriverUnavailable
from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import TrackerSample, TrackingState

__all__ = ["NOWHERE", "records", "sample_of"]

# TrackedDevicePose_t:
#   bytes  0-47  float[3][4]  device to tracking space: rotation | position, metres, by rows
#         48-59  float[3]     velocity, m/s
#         60-71  float[3]     angular velocity, rad/s
#         72-75  int32        tracking result
#         76     bool         the pose is valid
#         77     bool         the device is connected
RECORD = np.dtype(
    [
        ("T", "<f4", (3, 4)),
        ("velocity", "<f4", 3),
        ("spin", "<f4", 3),
        ("result", "<i4"),
        ("valid", "?"),
        ("connected", "?"),
        ("padding", "V2"),
    ]
)

OUT_OF_RANGE = TrackingState.OUT_OF_RANGE
STATES = {
    1: TrackingState.CALIBRATING,  # not initialised
    100: TrackingState.CALIBRATING,
    101: OUT_OF_RANGE,
    200: TrackingState.OK,
    201: OUT_OF_RANGE,  # both may say "valid" and mean a guess
    300: TrackingState.INERTIAL,  # rotation only
}

NOWHERE = PartialPose(np.eye(3), None)
"""The pose of a device before it was tracked."""


def records(poses: "ctypes.Array[Any]") -> npt.NDArray[np.void]:
    """SteamVR's pose array, seen as records; no copy.

    Raises:
        DriverUnavailable: the package's struct has another size than the layout above.
    """
    size = ctypes.sizeof(poses) // len(poses)
    if size != RECORD.itemsize:
        raise DriverUnavailable(
            f"a pose of this package openvr has {size} bytes, not {RECORD.itemsize}: "
            "pip install openvr==2.12.1401"
        )
    return np.frombuffer(memoryview(poses), dtype=RECORD)


def sample_of(serial: str, record: np.void, held: PartialPose, time_s: float) -> TrackerSample:
    """One device's record as a sample.

    Args:
        serial: of the device.
        record: one of ``records``.
        held: its last tracked pose, given again while there is none.
        time_s: when SteamVR was asked; a record carries no time of its own.
    """
    state = _state(record)
    tracked = state is TrackingState.OK
    velocity = np.array(record["velocity"], dtype=np.float64) if tracked else None
    return TrackerSample(serial, _pose(record, state, held), time_s, tracked, state, velocity)


def _state(record: np.void) -> TrackingState:
    if not record["connected"]:
        return TrackingState.GONE
    state = STATES.get(int(record["result"]), TrackingState.OCCLUDED)
    if state is TrackingState.OK and not record["valid"]:
        return TrackingState.OCCLUDED
    return state


def _pose(record: np.void, state: TrackingState, held: PartialPose) -> PartialPose:
    if state is TrackingState.GONE or not record["valid"]:
        return held
    T: Array = np.array(record["T"], dtype=np.float64)
    return PartialPose(T[:, :3], None if state is TrackingState.INERTIAL else T[:, 3])
