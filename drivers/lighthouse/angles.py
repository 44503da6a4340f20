"""What decoding hands to solving: angles, IMU samples, device models, station calibrations.

Times are ticks of a device's own 48 MHz clock, unwrapped to 64 bits (drivers/lighthouse/ticks.py).
Frames: a device's IMU frame; a station's own frame (X right, Y up, it looks along -Z). Metres,
radians, g.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array

__all__ = [
    "TICKS_PER_S",
    "Angles",
    "DeviceModel",
    "ImuSamples",
    "Ints",
    "StationCalibration",
]

TICKS_PER_S = 48_000_000
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Angles:
    """Where sensors of one device were hit by sweeps; m hits in the order of their decoding.

    Attributes:
        ticks: (m,) when, unwrapped device ticks.
        station: (m,) which base station. Gen1: 0 or 1, its place in the flash pattern; Gen2: its
            channel, 0 to 15.
        axis: (m,) 0 or 1: the rotor (Gen1) or the plane of light on it (Gen2).
        sensor: (m,) row of DeviceModel.points.
        angle_rad: (m,) as ``reproject`` gives it for the true position.
    """

    ticks: Ints
    station: Ints
    axis: Ints
    sensor: Ints
    angle_rad: Array

    def __len__(self) -> int:
        """Number of hits."""
        return len(self.ticks)

    @staticmethod
    def join(parts: Sequence["Angles"]) -> "Angles":
        """All hits, one part after the other; none of no parts."""
        none = np.zeros(0, dtype=np.int64)
        parts = [Angles(none, none, none, none, np.zeros(0)), *parts]
        return Angles(
            ticks=np.concatenate([part.ticks for part in parts]),
            station=np.concatenate([part.station for part in parts]),
            axis=np.concatenate([part.axis for part in parts]),
            sensor=np.concatenate([part.sensor for part in parts]),
            angle_rad=np.concatenate([part.angle_rad for part in parts]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class ImuSamples:
    """Calibrated IMU samples of one device, oldest first, in its IMU frame.

    Attributes:
        ticks: (k,) when, unwrapped device ticks.
        acc_g: (k, 3) specific force in g: at rest it points up and is 1 long.
        gyro_rad_s: (k, 3) angular velocity.
    """

    ticks: Ints
    acc_g: Array
    gyro_rad_s: Array

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.ticks)

    def take(self, which: NDArray[np.bool_] | Ints | slice) -> "ImuSamples":
        """Some of them."""
        return ImuSamples(self.ticks[which], self.acc_g[which], self.gyro_rad_s[which])

    @staticmethod
    def join(parts: Sequence["ImuSamples"]) -> "ImuSamples":
        """All samples, one part after the other; none of no parts."""
        parts = [ImuSamples(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3))), *parts]
        return ImuSamples(
            np.concatenate([part.ticks for part in parts]),
            np.concatenate([part.acc_g for part in parts]),
            np.concatenate([part.gyro_rad_s for part in parts]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class DeviceModel:
    """A device by its own configuration, brought into its IMU frame.

    Attributes:
        serial: as printed on the device, LHR-XXXXXXXX.
        device_class: hmd, controller, generic_tracker, or what else it calls itself.
        model: its model number, in words.
        points: (s, 3) light sensors, metres.
        normals: (s, 3) where they look, length 1.
        ports: (s,) hardware port of each sensor.
        T_imu_trackref: takes the frame of the device's drawings into the IMU frame.
        T_imu_head: takes the frame whose pose is reported into the IMU frame.
        acc_bias_g: (3,) a starting value only: sources disagree about its unit.
        acc_scale: (3,) factor.
        gyro_bias_rad_s: (3,) subtracted before the factor.
        gyro_scale: (3,) factor.
        product_id: the USB product id that it has by cable.
    """

    serial: str
    device_class: str
    model: str
    points: Array
    normals: Array
    ports: Ints
    T_imu_trackref: Pose
    T_imu_head: Pose
    acc_bias_g: Array
    acc_scale: Array
    gyro_bias_rad_s: Array
    gyro_scale: Array
    product_id: int = 0


def _zeros() -> Array:
    return np.zeros(2)


@dataclass(frozen=True, slots=True, eq=False)
class StationCalibration:
    """How a base station's two sweeps differ from ideal ones; it sends this about itself (OOTX).

    Two numbers each: by axis (Gen1) or plane (Gen2). The default is an ideal station.

    Attributes:
        generation: 1 or 2.
        id: the serial number on its back, as a number.
        phase: (2,) rad.
        tilt: (2,) Gen1: the tangent of what it sends; Gen2: rad.
        curve, gibphase, gibmag: (2,).
        ogeephase, ogeemag: (2,) Gen2 only, else 0.
        up: (3,) direction of up in the station's frame, length 1, or zeros: not told.
        mode: Gen1: 0, 1, 2 for A, B, C; Gen2: channel, 0 to 15.
        unlock_count: changes when it was restarted or pushed.
    """

    generation: int
    id: int = 0
    phase: Array = field(default_factory=_zeros)
    tilt: Array = field(default_factory=_zeros)
    curve: Array = field(default_factory=_zeros)
    gibphase: Array = field(default_factory=_zeros)
    gibmag: Array = field(default_factory=_zeros)
    ogeephase: Array = field(default_factory=_zeros)
    ogeemag: Array = field(default_factory=_zeros)
    up: Array = field(default_factory=lambda: np.zeros(3))
    mode: int = 0
    unlock_count: int = 0
