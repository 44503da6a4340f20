"""From the counts of a device's IMU to g and rad/s.

feature report 01
0  u8 01
1  u8 gyroscope: 250 deg/s times 2 to the power of this is full scale
2  u8 acceleration: 2 g times the same
"""

import math
from dataclasses import dataclass

from lobstr_hw.drivers.lighthouse.angles import DeviceModel, ImuSamples, Ints

__all__ = ["RANGES", "ImuRanges", "calibrate_imu", "parse_ranges"]

FULL_SCALE = 32768
RANGES = 0x01
HIGHEST_CODE = 4


@dataclass(frozen=True, slots=True)
class ImuRanges:
    """What full scale means; the default is that of everything but headsets."""

    gyro_deg_s: float = 2000.0
    acc_g: float = 8.0

    @staticmethod
    def of(model: DeviceModel) -> "ImuRanges":
        """The usual ranges of a device, for when it was not asked."""
        return ImuRanges(500.0, 4.0) if model.device_class == "hmd" else ImuRanges()


def parse_ranges(data: bytes) -> ImuRanges | None:
    """The answer to feature report 01, or None: none yet (zeros), or it makes no sense."""
    if len(data) < 3 or data[0] != RANGES or not any(data[1:3]):
        return None
    if max(data[1:3]) > HIGHEST_CODE:
        return None
    return ImuRanges(250.0 * 2.0 ** data[1], 2.0 * 2.0 ** data[2])


def calibrate_imu(ticks: Ints, counts: Ints, model: DeviceModel, ranges: ImuRanges) -> ImuSamples:
    """Apply a device's factory calibration.

    What the device calls its acceleration bias is subtracted as m/s^2: over the still moments of 14
    devices that gave the most constant |a|. Up to 0.02 g may be left: estimate it.

    Args:
        ticks: (k,) unwrapped.
        counts: (k, 6) acceleration x, y, z, gyroscope x, y, z.
        model: of the device.
        ranges: as it answered, or ``ImuRanges.of(model)``.
    """
    acc = counts[:, :3] * (ranges.acc_g / FULL_SCALE)
    gyro = counts[:, 3:] * (math.radians(ranges.gyro_deg_s) / FULL_SCALE)
    return ImuSamples(
        ticks=ticks,
        acc_g=acc * model.acc_scale - model.acc_bias_g,
        gyro_rad_s=(gyro - model.gyro_bias_rad_s) * model.gyro_scale,
    )
